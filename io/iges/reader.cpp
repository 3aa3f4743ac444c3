// From records to panels: follows the pointers of faces, boundaries and curves, keeps the ledger, quarantines what is
// bad.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "geometry/error.h"
#include "geometry/refine.h"
#include "io/file.h"
#include "io/iges.h"
#include "io/iges/entity.h"
#include "io/iges/face.h"
#include "io/iges/surfaces.h"
#include "io/iges/topology.h"
#include "io/outlines.h"

namespace toile {

namespace iges {
namespace {

// Composite curves within composite curves, transformations of transformations: deeper means a cycle.
constexpr int max_depth = 16;

// A face-bearing entity and where an instance or a solid puts it.
struct Job {
  const Entry* entry;
  Eigen::Affine3d placement;
};

class Reader {
 public:
  Reader(const File& file, PanelFile& out) : file_(file), out_(out), notes_(file.notes) {}
  void read();

 private:
  const Entry& entry(int sequence, const Entry& from, const char* role) const;
  const Entry& entry(int sequence, const Entry& from, const char* role, int type) const;
  void spend(const Entry& e);
  Eigen::Affine3d transform(const Entry& e);
  void append_curves(const Entry& e, std::vector<Curve3>& out, int depth);
  std::vector<Curve3> curves(int sequence, const Entry& from, const char* role);
  NaturalCurve natural_curve(const Entry& e, int depth = 0);
  Curve3 offset_curve(const Entry& e, int depth);
  double fit_tolerance(double size) const;

  Frame analytic_frame(const Entry& e, const Analytic& s);
  FileSurface surface(const Entry& e, const std::vector<BoundaryCurves>& boundaries, std::string& name, int depth = 0);
  FileSurface own_surface(const Entry& e, const Eigen::Affine3d& t, const std::vector<BoundaryCurves>& boundaries,
                          std::string& name, int depth);

  BoundaryCurves curve_on_surface(const Entry& e, int surface);
  BoundaryCurves boundary_list(const Entry& e, int surface);
  BoundaryCurves edge_loop(const Entry& e);
  const EdgeList& edges_of(const Entry& e);

  std::vector<TrimmedSurface> face(const Entry& e);
  std::string name_property(Parameters& in);
  void find_faces(std::vector<Job>& jobs);
  void expand(const Entry& e, const Eigen::Affine3d& placement, int depth, std::vector<Job>& jobs);
  void add_panels(const Job& job);
  void mark(const Entry& e, Disposition disposition, std::string why = {});
  void quarantine(const Entry& e, const std::string& why);
  void find_used_surfaces(std::set<int>& used);
  bool endless(const Entry& e) const;
  void finish_names();
  bool holds_faces() const;
  void read_outlines();
  void note(const Entry& e, const std::string& kind, const std::string& what) {
    notes_.add(kind, file_.place(e) + what);
  }

  const File& file_;
  PanelFile& out_;
  Notes notes_;
  std::map<int, EdgeList> edge_lists_;
  std::set<int> used_surfaces_;
  std::string first_failure_;
  std::vector<std::string> labels_;  // of the panels, for those without a name
  std::size_t spent_ = 0;            // characters of records that were read, again and again where they are shared
};

const Entry& Reader::entry(int sequence, const Entry& from, const char* role) const {
  const Entry* found = file_.find(sequence);
  if (!found)
    throw InputError(file_.place(from) + "pointer " + std::to_string(sequence) + " to its " + role +
                     " leads nowhere, must be an odd number up to " + std::to_string(2 * file_.entries.size() - 1));
  return *found;
}

const Entry& Reader::entry(int sequence, const Entry& from, const char* role, int type) const {
  const Entry& found = entry(sequence, from, role);
  if (found.type != type)
    throw InputError(file_.place(from) + "its " + role + " is an entity " + std::to_string(found.type) + ", must be " +
                     std::to_string(type));
  return found;
}

// Surfaces and curves may be shared; a small file that shares a large record ten thousand times is an attack.
void Reader::spend(const Entry& e) {
  const std::size_t limit = (std::size_t{64} << 20) + 16 * file_.text.size();
  spent_ += file_.record(e).size();
  if (spent_ > limit) throw InputError(file_.place(e) + "its record is shared too often for the size of the file");
}

void Reader::mark(const Entry& e, Disposition disposition, std::string why) {
  LedgerEntry& row = out_.ledger[static_cast<std::size_t>((e.sequence - 1) / 2)];
  if (row.disposition == Disposition::quarantined) return;
  if (row.disposition == Disposition::converted && disposition == Disposition::read) return;
  row.disposition = disposition;
  row.why = std::move(why);
}

// The entry's own matrix, with the matrices that it is defined under.
Eigen::Affine3d Reader::transform(const Entry& e) {
  Eigen::Affine3d result = Eigen::Affine3d::Identity();
  const Entry* at = &e;
  for (int depth = 0; at->transform != 0; ++depth) {
    if (depth == max_depth) throw InputError(file_.place(e) + "its transformations form a cycle");
    const Entry& matrix = entry(at->transform, *at, "transformation");
    if (matrix.type != 124)
      throw InputError(file_.place(*at) + "its transformation is an entity " + std::to_string(matrix.type) +
                       ", must be 124");
    Parameters in(file_, matrix, &notes_);
    result = read_transform(in) * result;
    mark(matrix, Disposition::read);
    at = &matrix;
  }
  return result;
}

bool is_identity(const Eigen::Affine3d& t) {
  return t.linear() == Eigen::Matrix3d::Identity() && t.translation() == Eigen::Vector3d::Zero();
}

Curve3 transformed(const Eigen::Affine3d& t, const Curve3& curve) {
  if (is_identity(t)) return curve;
  return Curve3(curve.knots(), t * curve.points(), curve.weights());
}

bool is_group(const Entry& e) {
  return e.type == 402 && (e.form == 1 || e.form == 7 || e.form == 9 || e.form == 14 || e.form == 15);
}

// A parameter of a record, the entity type being number 0; nullopt where it is no integer.
std::optional<int> nth_integer(const File& file, const Entry& e, int n) {
  try {
    Parameters in(file, e);
    if (n < in.size()) return parse_integer(in.token(n).text);
  } catch (const InputError&) {
    // The entity itself is quarantined for this, with the message.
  }
  return std::nullopt;
}

// How far a fitted curve or surface may lie from what the file means.
double Reader::fit_tolerance(double size) const {
  const double resolution = file_.global.resolution > 0 ? file_.global.resolution : 1e-7 * size;
  return std::clamp(resolution, 1e-9 * size, 1e-5 * size);
}

Curve3 Reader::offset_curve(const Entry& e, int depth) {
  Parameters in(file_, e, &notes_);
  const OffsetCurve record = read_offset_curve(in);
  const Curve3 base = natural_curve(entry(record.curve, e, "curve to offset"), depth + 1).curve;
  const double size = (base.points().rowwise().maxCoeff() - base.points().rowwise().minCoeff()).norm();
  FittedCurve fitted = to_curve(record, base, fit_tolerance(size));
  mark(e, Disposition::converted, "offset curve as cubic B-spline, off by " + format_real(fitted.error));
  return std::move(fitted.curve);
}

void Reader::append_curves(const Entry& e, std::vector<Curve3>& out, int depth) {
  if (depth > max_depth) throw InputError(file_.place(e) + "its curves form a cycle");
  const Kind* kind = find_kind(e.type);
  const std::size_t first = out.size();
  spend(e);
  if (e.type == 102) {
    Parameters in(file_, e, &notes_);
    for (int sequence : read_composite(in)) append_curves(entry(sequence, e, "curve"), out, depth + 1);
    // Shared curves inside shared composites could multiply without end.
    if (out.size() > 4 * file_.entries.size() + 16)
      throw InputError(file_.place(e) + "it repeats its curves too often");
    mark(e, Disposition::read);
  } else if (e.type == 130) {
    try {
      out.push_back(offset_curve(e, depth));
    } catch (const GeometryError& error) {
      throw InputError(file_.place(e) + error.what());
    }
  } else if (kind && kind->curve) {
    Parameters in(file_, e, &notes_);
    try {
      out.push_back(kind->curve(in));
    } catch (const GeometryError& error) {
      in.fail(error.what());
    }
    mark(e, kind->converted ? Disposition::converted : Disposition::read,
         kind->converted ? std::string(kind->name) + " as B-spline curve" : std::string());
  } else {
    throw InputError(file_.place(e) +
                     "as a boundary curve it is not read, must be 100, 102, 104, 106, 110, 112, 126 or 130");
  }
  const Eigen::Affine3d t = transform(e);
  for (std::size_t i = first; i < out.size(); ++i) out[i] = transformed(t, out[i]);
}

std::vector<Curve3> Reader::curves(int sequence, const Entry& from, const char* role) {
  std::vector<Curve3> out;
  append_curves(entry(sequence, from, role), out, 0);
  return out;
}

// With the file's own parameter along it, which a surface's parameters are made of.
NaturalCurve Reader::natural_curve(const Entry& e, int depth) {
  if (depth > max_depth) throw InputError(file_.place(e) + "its curves form a cycle");
  const Eigen::Affine3d t = transform(e);
  NaturalCurve out;
  if (e.type == 102) {
    spend(e);
    Parameters in(file_, e, &notes_);
    std::vector<NaturalCurve> pieces;
    for (int sequence : read_composite(in)) {
      pieces.push_back(natural_curve(entry(sequence, e, "curve"), depth + 1));
      if (pieces.size() > 4 * file_.entries.size() + 16)
        throw InputError(file_.place(e) + "it repeats its curves too often");
    }
    double size = 0;
    for (const NaturalCurve& piece : pieces) size = std::max(size, piece.curve.points().cwiseAbs().maxCoeff());
    try {
      out = joined(pieces, std::max(file_.global.resolution, 1e-6 * size));
    } catch (const GeometryError& error) {
      in.fail(error.what());
    }
    mark(e, Disposition::read);
  } else {
    std::vector<Curve3> one;
    append_curves(e, one, depth);
    out.curve = one.at(0);
    if (e.type == 100) {
      Parameters in(file_, e);
      const Interval angles = arc_angles(read_arc(in));
      out.curve = with_domain(out.curve, angles);
      out.turns = {{angles, (out.curve.knots().control_point_count() - 1) / 2, angles.length()}};
    }
    return out;  // the transformation is in it
  }
  out.curve = transformed(t, out.curve);
  return out;
}

Frame Reader::analytic_frame(const Entry& e, const Analytic& s) {
  const auto direction = [&](int sequence, const char* role) {
    const Entry& d = entry(sequence, e, role, 123);
    Parameters in(file_, d, &notes_);
    const Eigen::Vector3d x = read_direction(in);
    mark(d, Disposition::read);
    return Eigen::Vector3d(transform(d).linear() * x);
  };
  const Entry& location = entry(s.location, e, "location", 116);
  Parameters in(file_, location, &notes_);
  const Eigen::Vector3d origin = transform(location) * read_point(in).x;
  mark(location, Disposition::read);
  const Eigen::Vector3d axis = s.axis != 0 ? direction(s.axis, "axis") : Eigen::Vector3d::UnitZ();
  std::optional<Eigen::Vector3d> reference;
  if (s.reference != 0) reference = direction(s.reference, "reference direction");
  return frame(origin, axis, reference);
}

// Boundary curves seen from the surface's own definition space.
std::vector<BoundaryCurves> seen_from(const Eigen::Affine3d& t, const std::vector<BoundaryCurves>& boundaries) {
  const Eigen::Affine3d back = t.inverse();
  std::vector<BoundaryCurves> out = boundaries;
  for (BoundaryCurves& b : out)
    for (Curve3& c : b.model) c = transformed(back, c);
  return out;
}

// The surface before its own matrix `t`, and the boundaries alike; but planes are placed at once, so that their corners
// and their boundaries' parameters are the same numbers.
FileSurface Reader::own_surface(const Entry& e, const Eigen::Affine3d& t, const std::vector<BoundaryCurves>& boundaries,
                                std::string& name, int depth) {
  if (depth > max_depth) throw InputError(file_.place(e) + "its surfaces form a cycle");
  const bool trimmed = !boundaries.empty();
  spend(e);
  Parameters in(file_, e, &notes_);
  // Tolerance of what has to be fitted: the size is that of the net which the fit starts from.
  const auto tolerance = [&](const Eigen::Matrix3Xd& points) {
    return fit_tolerance((points.rowwise().maxCoeff() - points.rowwise().minCoeff()).norm());
  };
  // What bounds a surface without ends: model curves, else parameter curves, in its frame.
  const auto extent = [&](const Frame& f) {
    Eigen::AlignedBox3d box = reach(f, boundaries);
    if (!box.isEmpty()) return box;
    for (const BoundaryCurves& b : boundaries)
      for (const Curve3& c : b.parameter)
        for (const auto& p : c.points().colwise())
          box.extend(e.type == 108 || e.type == 190 ? Eigen::Vector3d(p.x(), p.y(), 0) : Eigen::Vector3d(0, 0, p.y()));
    return box;
  };
  switch (e.type) {
    case 108: {
      const Frame f = frame(read_plane(in)).placed(t);
      name = name_property(in);
      const Eigen::AlignedBox3d box = extent(f);
      if (box.isEmpty()) in.fail("a plane without a boundary has no end");
      return plane_patch(f, {box.min().head<2>(), box.max().head<2>()});
    }
    case 190:
    case 192:
    case 194:
    case 196:
    case 198: {
      const Analytic s = read_analytic(in);
      name = name_property(in);
      Frame f = analytic_frame(e, s);
      if (e.type == 190) f = f.placed(t);
      const Eigen::AlignedBox3d box = extent(f);
      if (e.type < 196 && box.isEmpty()) in.fail("a surface without a boundary has no end");
      if (e.type == 190) return plane_patch(f, {box.min().head<2>(), box.max().head<2>()});
      return to_surface(s, f, box.isEmpty() ? Interval{} : Interval{box.min().z(), box.max().z()});
    }
    case 114: {
      const PowerSurface s = read_power_surface(in);
      name = name_property(in);
      FileSurface out;
      out.surface = to_surface(s);
      out.how = "parametric spline surface as B-spline surface";
      return out;
    }
    case 118: {
      const Ruled ruled = read_ruled(in);
      name = name_property(in);
      NaturalCurve a = natural_curve(entry(ruled.first, e, "first curve")),
                   b = natural_curve(entry(ruled.second, e, "second curve"));
      Eigen::Matrix3Xd both(3, a.curve.points().cols() + b.curve.points().cols());
      both << a.curve.points(), b.curve.points();
      return to_surface(ruled, std::move(a), std::move(b), e.form == 0, tolerance(both));
    }
    case 120: {
      const Revolution revolution = read_revolution(in);
      name = name_property(in);
      const Curve3 axis = natural_curve(entry(revolution.axis, e, "axis")).curve;
      return to_surface(revolution, axis, natural_curve(entry(revolution.generatrix, e, "generatrix")));
    }
    case 122: {
      const Tabulated tabulated = read_tabulated(in);
      name = name_property(in);
      return to_surface(tabulated, natural_curve(entry(tabulated.directrix, e, "directrix")));
    }
    case 140: {
      const OffsetSurface offset = read_offset_surface(in);
      name = name_property(in);
      std::string base_name;
      // A boundary lies about as far along the base as along the offset.
      const FileSurface base = surface(entry(offset.surface, e, "surface to offset"), boundaries, base_name, depth + 1);
      return to_surface(offset, base, tolerance(base.surface.points()));
    }
    case 128:
      break;
    default:
      throw InputError(file_.place(e) +
                       "as a face's surface it is not read, must be 108, 114, 118, 120, 122, 128, 140, 190, 192, "
                       "194, 196 or 198");
  }
  // U0 to V1 say where an untrimmed surface ends. Where a loop bounds it the loop decides, and the surface keeps its
  // own knots and net: several exporters put the loop's bounding box there.
  const SplineSurface spline = read_spline_surface(in);
  name = name_property(in);
  FileSurface out;
  out.surface = spline.surface;
  if (!spline.covers_domain() && trimmed) {
    note(e, "partial", "U0 to V1 name a part of the knots' domain; the face is trimmed, so the domain stays");
  } else if (!spline.covers_domain()) {
    note(e, "restricted", "U0 to V1 name a part of the knots' domain; the surface is restricted to it");
    out.surface = restricted(spline);
    out.how = "restricted to U0, U1, V0, V1";
  }
  return out;
}

FileSurface Reader::surface(const Entry& e, const std::vector<BoundaryCurves>& boundaries, std::string& name,
                            int depth) {
  const Eigen::Affine3d t = transform(e);
  const bool as_they_are = e.type == 108 || e.type == 128 || e.type == 190 || is_identity(t);
  FileSurface out;
  try {
    out = own_surface(e, t, as_they_are ? boundaries : seen_from(t, boundaries), name, depth);
  } catch (const GeometryError& error) {
    throw InputError(file_.place(e) + error.what());
  }
  if (!is_identity(t) && !out.plane) out.surface = out.surface.with_points(t * out.surface.points());
  std::string how = out.how;
  if (out.error > 0) how += ", off by " + format_real(out.error);
  if (out.error > 0) note(e, "fitted surface", how);
  const Disposition disposition = how.empty() ? Disposition::read : Disposition::converted;
  mark(e, disposition, std::move(how));
  return out;
}

BoundaryCurves Reader::curve_on_surface(const Entry& e, int surface) {
  spend(e);
  Parameters in(file_, e, &notes_);
  const Boundary boundary = read_boundary(in);
  if (boundary.surface != 0 && boundary.surface != surface)
    note(e, "boundary surface",
         "it names surface " + std::to_string(boundary.surface) + ", its face names " + std::to_string(surface) +
             "; the face's is taken");
  if (boundary.parameter_curve == 0 && boundary.model_curve == 0)
    in.fail("it has neither a parameter curve nor a model curve");
  BoundaryCurves out;
  out.place = file_.place(e);
  std::string lost;
  if (boundary.model_curve != 0) {
    try {
      out.model = curves(boundary.model_curve, e, "model curve");
      const Eigen::Affine3d t = transform(e);
      for (Curve3& c : out.model) c = transformed(t, c);
    } catch (const InputError& error) {
      if (boundary.parameter_curve == 0 || boundary.parameter_curve == boundary.model_curve) throw;
      lost = std::string(error.what()) + "; the model curve of the boundary is ignored";
      out.model.clear();
    }
  }
  // A parameter curve that is the model curve itself (planes of some exporters) is none.
  if (boundary.parameter_curve != 0 && boundary.parameter_curve != boundary.model_curve) {
    try {
      out.parameter = curves(boundary.parameter_curve, e, "parameter curve");
    } catch (const InputError& error) {
      if (out.model.empty()) throw;
      notes_.add("bad parameter curve", std::string(error.what()) + "; the parameter curve of the boundary is ignored");
      out.parameter.clear();
    }
  }
  if (!lost.empty()) notes_.add("bad model curve", lost);
  return out;
}

BoundaryCurves Reader::boundary_list(const Entry& e, int surface) {
  spend(e);
  Parameters in(file_, e, &notes_);
  const BoundaryList boundary = read_boundary_list(in);
  if (boundary.surface != 0 && boundary.surface != surface)
    note(e, "boundary surface",
         "it names surface " + std::to_string(boundary.surface) + ", its face names " + std::to_string(surface) +
             "; the face's is taken");
  BoundaryCurves out;
  out.place = file_.place(e);
  const Eigen::Affine3d t = transform(e);
  bool every_edge = true;
  for (const BoundaryUse& use : boundary.curves) {
    std::vector<Curve3> model = use.model != 0 ? curves(use.model, e, "model curve") : std::vector<Curve3>{};
    if (use.sense == 2) {
      std::reverse(model.begin(), model.end());
      for (Curve3& c : model) c = reversed(c);
    }
    for (const Curve3& c : model) out.model.push_back(transformed(t, c));
    every_edge = every_edge && !use.parameter_curves.empty();
    for (const int sequence : use.parameter_curves) {
      if (sequence == use.model) {
        every_edge = false;
        continue;
      }
      for (Curve3& c : curves(sequence, e, "parameter curve")) out.parameter.push_back(std::move(c));
    }
  }
  if (!every_edge) out.parameter.clear();
  if (out.model.empty() && out.parameter.empty()) in.fail("it has neither parameter curves nor model curves");
  mark(e, Disposition::read);
  return out;
}

const EdgeList& Reader::edges_of(const Entry& e) {
  const auto found = edge_lists_.find(e.sequence);
  if (found != edge_lists_.end()) return found->second;
  Parameters in(file_, e, &notes_);
  const EdgeList& list = edge_lists_[e.sequence] = read_edge_list(in);
  mark(e, Disposition::read);
  std::set<int> vertex_lists;
  for (const Edge& edge : list.edges) vertex_lists.insert({edge.vertices[0], edge.vertices[2]});
  for (const int sequence : vertex_lists)
    if (const Entry* vertices = file_.find(sequence); vertices && vertices->type == 502)
      mark(*vertices, Disposition::read);
  return list;
}

BoundaryCurves Reader::edge_loop(const Entry& e) {
  spend(e);
  Parameters in(file_, e, &notes_);
  const EdgeLoop loop = read_edge_loop(in);
  BoundaryCurves out;
  out.place = file_.place(e);
  const Eigen::Affine3d t = transform(e);
  bool every_edge = true;
  for (const EdgeUse& use : loop.edges) {
    for (const EdgeUse::ParameterCurve& curve : use.curves)
      for (Curve3& c : curves(curve.curve, e, "parameter curve")) out.parameter.push_back(std::move(c));
    // A vertex is a collapsed edge: it has a parameter curve or none, never a model curve.
    if (use.vertex) continue;
    every_edge = every_edge && !use.curves.empty();
    const Entry& list = entry(use.list, e, "edge list", 504);
    const std::vector<Edge>& edges = edges_of(list).edges;
    if (use.index < 1 || use.index > static_cast<int>(edges.size()))
      in.fail("it names edge " + std::to_string(use.index) + " of a list of " + std::to_string(edges.size()));
    std::vector<Curve3> model = curves(edges[static_cast<std::size_t>(use.index) - 1].curve, list, "curve of an edge");
    if (!use.forward) {
      std::reverse(model.begin(), model.end());
      for (Curve3& c : model) c = reversed(c);
    }
    for (const Curve3& c : model) out.model.push_back(transformed(t, c));
  }
  if (!every_edge) out.parameter.clear();
  mark(e, Disposition::read);
  return out;
}

// What follows an entity's own parameters: associativities, then properties; the first 406 form 15 among them.
std::string Reader::name_property(Parameters& in) {
  std::string name;
  try {
    for (int list = 0; list < 2; ++list) {
      if (in.left() <= 0) return name;
      const int n = in.integer("number of associated entities");
      if (n < 0 || n > in.left()) return name;
      for (int i = 0; i < n; ++i) {
        const Entry* e = file_.find(std::abs(in.pointer("pointer to an associated entity")));
        if (!e || e->type != 406 || e->form != 15 || !name.empty()) continue;
        Parameters property(file_, *e, &notes_);
        name = read_name(property).value_or("");
        mark(*e, Disposition::read);
      }
    }
  } catch (const InputError& error) {
    notes_.add("bad property", error.what());
  }
  return name;
}

// The panels of one face in its own definition space: its own 124 and its placement come later.
std::vector<TrimmedSurface> Reader::face(const Entry& e) {
  Parameters in(file_, e, &notes_);
  std::vector<BoundaryCurves> boundaries;
  std::vector<const Entry*> entries;
  FaceOptions options;
  options.resolution = file_.global.resolution;
  options.note = [this](const std::string& kind, const std::string& message) { notes_.add(kind, message); };
  int support = e.sequence;  // a free surface is its own
  bool bounded_by_domain = false;
  std::string name;
  const auto add = [&](BoundaryCurves curves, const Entry& from) {
    boundaries.push_back(std::move(curves));
    entries.push_back(&from);
  };
  if (e.type == 144) {
    const Face record = read_face(in);
    name = name_property(in);
    support = record.surface;
    bounded_by_domain = record.outer == 0;
    if (record.outer_was_denied) note(e, "N1", "N1 is 0 though an outer boundary is given; the boundary is taken");
    std::vector<int> loops = record.holes;
    if (record.outer != 0) loops.insert(loops.begin(), record.outer);
    for (std::size_t i = 0; i < loops.size(); ++i) {
      const char* role = i == 0 && record.outer != 0 ? "outer boundary" : "inner boundary";
      const Entry& from = entry(loops[i], e, role);
      if (from.type == 141) {
        note(e, "141 in 144", "its boundary is an entity 141, must be 142; it is read as one");
        add(boundary_list(from, support), from);
      } else if (from.type == 142) {
        add(curve_on_surface(from, support), from);
      } else {
        throw InputError(file_.place(from) + "as a boundary of a trimmed surface it must be entity 142");
      }
    }
  } else if (e.type == 143) {
    const BoundedSurface record = read_bounded_surface(in);
    name = name_property(in);
    support = record.surface;
    options.outer_known = false;
    for (const int sequence : record.boundaries) {
      const Entry& from = entry(sequence, e, "boundary");
      if (from.type == 142) {
        note(e, "142 in 143", "its boundary is an entity 142, must be 141; it is read as one");
        add(curve_on_surface(from, support), from);
      } else {
        add(boundary_list(entry(sequence, e, "boundary", 141), support), from);
      }
    }
  } else if (e.type == 510) {
    const TopologicalFace record = read_topological_face(in);
    name = name_property(in);
    support = record.surface;
    options.outer_known = record.outer_first;
    for (const int sequence : record.loops) {
      const Entry& from = entry(sequence, e, "loop", 508);
      BoundaryCurves curves = edge_loop(from);
      // A loop that is one vertex bounds nothing: a whole sphere.
      if (curves.model.empty() && curves.parameter.empty()) continue;
      add(std::move(curves), from);
    }
  }
  std::string surface_name;
  FileSurface base = surface(entry(support, e, "surface"), boundaries, surface_name);
  if (name.empty()) name = surface_name;
  std::vector<TrimmedSurface> panels;
  if (boundaries.empty() || bounded_by_domain) {
    TrimmedSurface whole;
    whole.surface = base.surface;
    whole.loops.push_back(natural_loop(base.surface));
    whole.natural_bounds = boundaries.empty();
    if (!boundaries.empty()) {
      // Every loop is a hole in the domain: as if its border were given.
      std::vector<BoundaryCurves> all(1);
      all[0].place = file_.place(e);
      for (const TrimCurve& c : whole.loops[0].curves) {
        Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, 2);
        points.topRows<2>() = c.curve.points();
        all[0].parameter.emplace_back(c.curve.knots(), std::move(points));
      }
      all.insert(all.end(), std::make_move_iterator(boundaries.begin()), std::make_move_iterator(boundaries.end()));
      boundaries = std::move(all);
      entries.insert(entries.begin(), &e);
    } else {
      panels.push_back(std::move(whole));
    }
  }
  if (panels.empty()) {
    try {
      panels = make_faces(base, boundaries, options);
    } catch (const GeometryError& error) {
      throw InputError(error.what());
    }
  }
  for (std::size_t i = 0; i < entries.size(); ++i)
    mark(*entries[i], boundaries[i].converted.empty() ? Disposition::read : Disposition::converted,
         boundaries[i].converted);
  for (std::size_t i = 0; i < panels.size(); ++i) {
    panels[i].name = i == 0 || name.empty() ? name : name + " (" + std::to_string(i + 1) + ")";
    for (std::size_t k = 0; k < panels[i].loops.size(); ++k) panels[i].loops[k].index = static_cast<int>(k);
  }
  if (e.sequence != support) mark(e, Disposition::read);
  return panels;
}

// Surfaces that another entity is made of. Groups and properties don't use what they name.
void Reader::find_used_surfaces(std::set<int>& used) {
  std::vector<int> doubtful;  // dependent by their status, though nobody known uses them
  for (const Entry& e : file_.entries) {
    int parameter = 0;  // where the pointer to a surface stands
    switch (e.type) {
      case 114:
      case 118:
      case 120:
      case 122:
      case 128:
      case 140:
        if (e.subordinate == 1 || e.subordinate == 3) doubtful.push_back(e.sequence);
        if (e.type != 140) continue;
        parameter = 5;
        break;
      case 144:
      case 510:
        parameter = 1;
        break;
      case 142:
      case 143:
        parameter = 2;
        break;
      case 141:
        parameter = 3;
        break;
      default:
        continue;
    }
    const std::optional<int> pointer = nth_integer(file_, e, parameter);
    if (pointer) used.insert(*pointer);
  }
  std::erase_if(doubtful, [&](int sequence) { return used.count(sequence) != 0; });
  if (doubtful.empty()) return;
  for (const Entry& e : file_.entries) {
    if (find_kind(e.type) || e.count == 0) continue;
    Tokens tokens;
    tokenize(file_.record(e), file_.delimiters, tokens);
    for (const Token& token : tokens.list) {
      const std::optional<int> pointer = token.is_string ? std::nullopt : parse_integer(token.text);
      if (pointer && std::binary_search(doubtful.begin(), doubtful.end(), *pointer)) used.insert(*pointer);
    }
  }
}

// An offset of a plane, a cylinder or a cone has no end of its own.
bool Reader::endless(const Entry& e) const {
  const Entry* base = &e;
  for (int depth = 0; base && base->type == 140 && depth <= max_depth; ++depth)
    base = file_.find(nth_integer(file_, *base, 5).value_or(0));
  return base && (base->type == 108 || base->type == 190 || base->type == 192 || base->type == 194);
}

// Faces, surfaces that nobody uses, and what holds such.
void Reader::expand(const Entry& e, const Eigen::Affine3d& placement, int depth, std::vector<Job>& jobs) {
  if (depth > max_depth) throw InputError(file_.place(e) + "its instances form a cycle");
  if (jobs.size() > 4 * file_.entries.size() + 10000) throw InputError(file_.place(e) + "its instances are too many");
  switch (e.type) {
    case 114:
    case 118:
    case 120:
    case 122:
    case 128:
    case 140:
      if (used_surfaces_.count(e.sequence) != 0 || endless(e)) return;
      [[fallthrough]];
    case 143:
    case 144:
    case 510:
      jobs.push_back({&e, placement});
      return;
    case 186: {
      spend(e);
      Parameters in(file_, e, &notes_);
      const Eigen::Affine3d t = placement * transform(e);
      for (const Use& use : read_solid(in).shells) expand(entry(use.sequence, e, "shell", 514), t, depth + 1, jobs);
      break;
    }
    case 514: {
      spend(e);
      Parameters in(file_, e, &notes_);
      const Eigen::Affine3d t = placement * transform(e);
      for (const Use& use : read_shell(in).faces) expand(entry(use.sequence, e, "face", 510), t, depth + 1, jobs);
      break;
    }
    case 408: {
      spend(e);
      Parameters in(file_, e, &notes_);
      const Instance instance = read_instance(in);
      const Entry& definition = entry(instance.definition, e, "subfigure definition", 308);
      const Eigen::Affine3d t = placement * transform(e) * iges::placement(instance);
      Parameters members(file_, definition, &notes_);
      for (const int member : read_definition(members).members)
        expand(entry(member, definition, "member"), t, depth + 1, jobs);
      mark(definition, Disposition::read);
      break;
    }
    case 402: {
      if (depth == 0 || !is_group(e)) return;  // elsewhere the members stand for themselves
      spend(e);
      Parameters in(file_, e, &notes_);
      for (const int member : read_group(in)) expand(entry(member, e, "member"), placement, depth + 1, jobs);
      break;
    }
    default:
      return;
  }
  mark(e, Disposition::read);
}

void Reader::find_faces(std::vector<Job>& jobs) {
  find_used_surfaces(used_surfaces_);
  // What a definition, a shell or a solid holds appears where those put it.
  std::set<int> held;
  const auto hold = [&](const Entry& e, auto&& members) {
    try {
      for (const int member : members()) {
        held.insert(member);
        // A group within a definition holds its members too.
        const Entry* group = e.type == 308 ? file_.find(member) : nullptr;
        if (!group || !is_group(*group)) continue;
        Parameters in(file_, *group);
        for (const int inner : read_group(in)) held.insert(inner);
      }
    } catch (const InputError& error) {
      quarantine(e, error.what());
    }
  };
  const auto sequences = [](const std::vector<Use>& uses) {
    std::vector<int> out;
    for (const Use& use : uses) out.push_back(use.sequence);
    return out;
  };
  for (const Entry& e : file_.entries) {
    const auto reader = [&](auto&& read) {
      return [&, read] {
        Parameters in(file_, e);
        return read(in);
      };
    };
    if (e.type == 308) hold(e, reader([](Parameters& in) { return read_definition(in).members; }));
    if (e.type == 186) hold(e, reader([&](Parameters& in) { return sequences(read_solid(in).shells); }));
    if (e.type == 514) hold(e, reader([&](Parameters& in) { return sequences(read_shell(in).faces); }));
    if (e.type == 402 && is_group(e)) {
      try {
        Parameters in(file_, e);
        read_group(in);
        mark(e, Disposition::read);
      } catch (const InputError& error) {
        quarantine(e, error.what());
      }
    }
  }
  for (const Entry& e : file_.entries) {
    if (held.count(e.sequence) != 0) continue;
    const std::size_t before = jobs.size();
    try {
      expand(e, Eigen::Affine3d::Identity(), 0, jobs);
    } catch (const InputError& error) {
      jobs.resize(before, Job{nullptr, Eigen::Affine3d::Identity()});
      quarantine(e, error.what());
    }
  }
}

void Reader::quarantine(const Entry& e, const std::string& why) {
  LedgerEntry& row = out_.ledger[static_cast<std::size_t>((e.sequence - 1) / 2)];
  row.disposition = Disposition::quarantined;
  row.why = why;
  notes_.add("quarantine " + std::to_string(e.sequence), why + " (directory entry " + std::to_string(e.sequence) +
                                                             ", entity " + std::to_string(e.type) + ", is left out)");
  if (first_failure_.empty()) first_failure_ = why;
}

void Reader::add_panels(const Job& job) {
  const Entry& e = *job.entry;
  try {
    // A surface of its own has its matrix applied on reading.
    const bool face_entity = e.type == 143 || e.type == 144 || e.type == 510;
    const Eigen::Affine3d t = face_entity ? Eigen::Affine3d(job.placement * transform(e)) : job.placement;
    for (TrimmedSurface& panel : face(e)) {
      if (!is_identity(t)) {
        panel.surface = panel.surface.with_points(t * panel.surface.points());
        for (TrimLoop& loop : panel.loops)
          for (TrimCurve& c : loop.curves)
            if (c.model) c.model = transformed(t, *c.model);
      }
      panel.metres_per_unit = out_.metres_per_unit;
      panel.resolution = out_.resolution;
      panel.source = file_.name + ":" + std::to_string(e.line) + ": entity " + std::to_string(e.type);
      out_.panels.push_back(std::move(panel));
      labels_.push_back(e.label);
    }
  } catch (const InputError& error) {
    quarantine(e, error.what());  // its parts may be read; the face is not there
  } catch (const GeometryError& error) {
    quarantine(e, file_.place(e) + error.what());
  }
}

// 406 form 15, else the directory's label where no other panel has it, else a number.
void Reader::finish_names() {
  std::map<std::string, int> taken;
  for (std::size_t i = 0; i < out_.panels.size(); ++i) {
    const std::string& name = out_.panels[i].name;
    ++taken[name.empty() ? labels_[i] : name];
  }
  for (std::size_t i = 0; i < out_.panels.size(); ++i) {
    std::string& name = out_.panels[i].name;
    if (!name.empty()) continue;
    name = !labels_[i].empty() && taken[labels_[i]] == 1 ? labels_[i] : "panel_" + std::to_string(i + 1);
  }
}

bool Reader::holds_faces() const {
  constexpr std::array<int, 19> types{108, 114, 118, 120, 122, 128, 140, 141, 142, 143,
                                      144, 186, 190, 192, 194, 196, 198, 510, 514};
  return std::ranges::any_of(file_.entries,
                             [&](const Entry& e) { return std::ranges::find(types, e.type) != types.end(); });
}

// A drawing without any face: closed plane outlines are panels. (iges.md, 12)
void Reader::read_outlines() {
  std::set<int> parts;  // of composite curves and of definitions
  for (const Entry& e : file_.entries) {
    if (e.type != 102 && e.type != 308) continue;
    try {
      Parameters in(file_, e);
      for (const int sequence : e.type == 102 ? read_composite(in) : read_definition(in).members)
        parts.insert(sequence);
    } catch (const InputError&) {
      // Reported where the entity itself is read.
    }
  }
  std::map<std::string, int> names;
  std::vector<LooseCurve> curves;
  std::vector<LoosePoint> points;
  for (const Entry& e : file_.entries) {
    const Kind* kind = find_kind(e.type);
    const bool curve = e.type == 102 || e.type == 130 || (kind && kind->curve);
    const bool drawing = e.type == 106 && e.form >= 20 && e.form != 63;  // centre lines, hatching, witness lines
    if (parts.count(e.sequence) != 0 || drawing || !(curve || e.type == 116 || e.type == 212)) continue;
    try {
      Parameters in(file_, e, &notes_);
      const auto add_point = [&](const Eigen::Vector3d& at, const std::string& words) {
        points.push_back({e.sequence, e.label, transform(e) * at, words});
        mark(e, Disposition::read);
      };
      if (e.type == 116) {
        add_point(read_point(in).x, "");
      } else if (e.type == 212) {
        for (const NoteString& line : read_note(in)) add_point(line.at, line.text);
      } else if (e.type == 106 && e.form <= 3) {
        const CopiousData data = read_copious(in);
        const std::size_t width = data.kind == 1 ? 2 : data.kind == 2 ? 3 : 6;
        for (std::size_t k = 0; k + width <= data.numbers.size(); k += width)
          add_point({data.numbers[k], data.numbers[k + 1], data.kind == 1 ? data.height : data.numbers[k + 2]}, "");
      } else {
        LooseCurve loose{e.sequence, {}, this->curves(e.sequence, e, "curve")};
        // The pointers to properties stand behind the entity's own parameters.
        if (kind && kind->curve) {
          kind->curve(in);
          loose.name = name_property(in);
        } else if (e.type == 102) {
          read_composite(in);
          loose.name = name_property(in);
        }
        if (loose.name.empty()) loose.name = e.label;
        ++names[loose.name];
        curves.push_back(std::move(loose));
      }
    } catch (const Error& error) {
      quarantine(e, error.what());
    }
  }
  if (curves.empty()) return;
  Outlines found = find_outlines(std::move(curves), points, out_.resolution);
  for (const OutlineNote& n : found.notes) note(*file_.find(n.id), "outline " + n.what, n.what);
  for (std::size_t k = 0; k < found.panels.size(); ++k) {
    TrimmedSurface& panel = found.panels[k];
    const Entry& e = *file_.find(found.ids[k]);
    // A label that many entities carry ("LINE", "COMPCURV") is no name.
    if (names[panel.name] > 1) panel.name.clear();
    labels_.push_back({});
    panel.metres_per_unit = out_.metres_per_unit;
    panel.resolution = out_.resolution;
    panel.source = file_.name + ":" + std::to_string(e.line) + ": entity " + std::to_string(e.type);
    out_.panels.push_back(std::move(panel));
  }
}

void Reader::read() {
  const Global& g = file_.global;
  out_.path = file_.name;
  out_.unit = g.unit;
  out_.metres_per_unit = g.metres_per_unit;
  out_.resolution = g.resolution;
  for (const std::string& part : {g.product, g.system, g.preprocessor})
    if (!part.empty() && out_.exporter.find(part) == std::string::npos)
      out_.exporter += (out_.exporter.empty() ? "" : ", ") + part;
  std::map<int, int> unread;
  for (const Entry& e : file_.entries) {
    ++out_.entities[e.type];
    const bool known = find_kind(e.type) != nullptr;
    if (!known) ++unread[e.type];
    out_.ledger.push_back({e.sequence, e.line, e.type, e.form, Disposition::kept,
                           known ? "no face uses it" : "not known here; its record is kept as it stands"});
  }
  std::vector<Job> jobs;
  find_faces(jobs);
  for (const Job& job : jobs) add_panels(job);
  if (!holds_faces()) read_outlines();
  if (out_.panels.empty() && !first_failure_.empty()) throw InputError(first_failure_);
  finish_names();
  out_.warnings = notes_.list();
  // Notes of a drawing are read though no record is made anew from them.
  for (const LedgerEntry& row : out_.ledger)
    if (row.type == 212 && row.disposition == Disposition::read && --unread[row.type] == 0) unread.erase(row.type);
  for (const auto& [type, count] : unread)
    out_.warnings.push_back("entity " + std::to_string(type) + ": " + std::to_string(count) + " kept, not read");
}

}  // namespace
}  // namespace iges

PanelFile parse_iges(std::string_view text, const std::string& name) {
  PanelFile out;
  out.file = iges::parse_file(text, name);
  iges::Reader(*out.file, out).read();
  return out;
}

PanelFile read_iges(const std::filesystem::path& path) {
  return parse_iges(read_file(path), path.string());
}

}  // namespace toile
