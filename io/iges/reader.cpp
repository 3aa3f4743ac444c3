// From records to panels: follows the pointers of faces, boundaries and curves, keeps the ledger, quarantines what is bad.
#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "geometry/error.h"
#include "geometry/refine.h"
#include "io/file.h"
#include "io/iges.h"
#include "io/iges/entity.h"
#include "io/outlines.h"

namespace toile {

namespace iges {
namespace {

// Composite curves within composite curves, transformations of transformations: deeper means a cycle.
constexpr int max_depth = 16;

struct Piece {
  Curve3 curve;
  int sequence = 0;
};

class Reader {
 public:
  Reader(const File& file, PanelFile& out) : file_(file), out_(out), notes_(file.notes) {}
  void read();

 private:
  const Entry& entry(int sequence, const Entry& from, const char* role) const;
  void spend(const Entry& e);
  Eigen::Affine3d transform(const Entry& e);
  void append_curves(const Entry& e, std::vector<Piece>& out, int depth);
  std::vector<Piece> curves(int sequence, const Entry& from, const char* role);
  TrimLoop loop(const Entry& boundary, int surface, const NurbsSurface& s, const Eigen::Affine3d& face_transform);
  NurbsSurface surface(const Entry& e, bool trimmed, std::string& name);
  TrimmedSurface face(const Entry& e);
  TrimmedSurface free_surface(const Entry& e);
  std::string name_property(Parameters& in);
  void mark(const Entry& e, Disposition disposition, std::string why = {});
  void find_used_surfaces(std::set<int>& used);
  void finish_panel(TrimmedSurface panel, const Entry& e);
  void finish_names();
  bool holds_faces() const;
  void read_outlines();
  void note(const Entry& e, const std::string& kind, const std::string& what) { notes_.add(kind, file_.place(e) + what); }

  const File& file_;
  PanelFile& out_;
  Notes notes_;
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
      throw InputError(file_.place(*at) + "its transformation is an entity " + std::to_string(matrix.type) + ", must be 124");
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

void Reader::append_curves(const Entry& e, std::vector<Piece>& out, int depth) {
  if (depth > max_depth) throw InputError(file_.place(e) + "its composite curves form a cycle");
  const Kind* kind = find_kind(e.type);
  const std::size_t first = out.size();
  spend(e);
  if (e.type == 102) {
    Parameters in(file_, e, &notes_);
    for (int sequence : read_composite(in)) append_curves(entry(sequence, e, "curve"), out, depth + 1);
    // Shared curves inside shared composites could multiply without end.
    if (out.size() > 4 * file_.entries.size() + 16) throw InputError(file_.place(e) + "it repeats its curves too often");
    mark(e, Disposition::read);
  } else if (kind && kind->curve) {
    Parameters in(file_, e, &notes_);
    try {
      out.push_back({kind->curve(in), e.sequence});
    } catch (const GeometryError& error) {
      in.fail(error.what());
    }
    mark(e, kind->converted ? Disposition::converted : Disposition::read,
         kind->converted ? std::string(kind->name) + " as B-spline curve" : std::string());
  } else {
    throw InputError(file_.place(e) + "as a boundary curve it is not read, must be 100, 102, 106, 110 or 126");
  }
  const Eigen::Affine3d t = transform(e);
  for (std::size_t i = first; i < out.size(); ++i) out[i].curve = transformed(t, out[i].curve);
}

std::vector<Piece> Reader::curves(int sequence, const Entry& from, const char* role) {
  std::vector<Piece> out;
  append_curves(entry(sequence, from, role), out, 0);
  return out;
}

Curve2 flattened(const Curve3& curve) { return Curve2(curve.knots(), curve.points().topRows<2>(), curve.weights()); }

// Largest distance between neighbours' ends, relative to the domain, and how far the curves leave the domain, alike.
struct Fit {
  double gap = 0, excursion = 0;
};
Fit fit_of(const std::vector<Curve2>& curves, const NurbsSurface& s) {
  const Interval u = s.u().domain(), v = s.v().domain();
  const Eigen::Vector2d size(u.length(), v.length());
  Fit fit;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const Eigen::Vector2d jump = curves[(i + 1) % curves.size()].start() - curves[i].end();
    fit.gap = std::max(fit.gap, jump.cwiseQuotient(size).norm());
    for (const Eigen::Vector2d& p : {curves[i].start(), curves[i].end()}) {
      fit.excursion = std::max({fit.excursion, (u.min - p.x()) / size.x(), (p.x() - u.max) / size.x(),
                                (v.min - p.y()) / size.y(), (p.y() - v.max) / size.y()});
    }
  }
  return fit;
}

// Parameter curves of model curves on an affine patch: the inverse map on their control points, exact.
std::vector<Curve2> pulled_back(const std::vector<Piece>& model, const AffinePatch& patch) {
  Eigen::Matrix<double, 3, 2> map;
  map << patch.du, patch.dv;
  const Eigen::Matrix<double, 2, 3> inverse = (map.transpose() * map).inverse() * map.transpose();
  std::vector<Curve2> out;
  for (const Piece& piece : model)
    out.emplace_back(piece.curve.knots(), Curve2::Points(inverse * (piece.curve.points().colwise() - patch.origin)),
                     piece.curve.weights());
  return out;
}

TrimLoop Reader::loop(const Entry& e, int surface, const NurbsSurface& s, const Eigen::Affine3d& face_transform) {
  if (e.type != 142)
    throw InputError(file_.place(e) + "as a boundary of a trimmed surface it must be entity 142");
  spend(e);
  Parameters in(file_, e, &notes_);
  const Boundary boundary = read_boundary(in);
  if (boundary.surface != 0 && boundary.surface != surface)
    note(e, "boundary surface", "it names surface " + std::to_string(boundary.surface) + ", its face names " +
                                    std::to_string(surface) + "; the face's is taken");
  if (boundary.parameter_curve == 0 && boundary.model_curve == 0)
    in.fail("it has neither a parameter curve nor a model curve");

  std::vector<Piece> model;
  if (boundary.model_curve != 0) {
    try {
      model = curves(boundary.model_curve, e, "model curve");
      const Eigen::Affine3d t = face_transform * transform(e);
      for (Piece& piece : model) piece.curve = transformed(t, piece.curve);
    } catch (const InputError& error) {
      if (boundary.parameter_curve == 0) throw;
      notes_.add("bad model curve", std::string(error.what()) + "; the model curve of the boundary is ignored");
      model.clear();
    }
  }

  // A parameter curve that is the model curve itself (planes of some exporters) is none.
  std::vector<Curve2> flat;
  std::string trouble;
  if (boundary.parameter_curve == 0 || boundary.parameter_curve == boundary.model_curve) {
    trouble = boundary.parameter_curve == 0 ? "there is no parameter curve" : "its parameter curve is its model curve";
  } else {
    try {
      for (Piece& piece : curves(boundary.parameter_curve, e, "parameter curve")) flat.push_back(flattened(piece.curve));
      constexpr double usable = 1e-3;  // of the domain; beyond it validation refuses a loop
      const Fit fit = fit_of(flat, s);
      if (fit.gap > usable) trouble = "its parameter curves don't close: gap " + format_real(fit.gap) + " of the domain";
      if (fit.excursion > usable) trouble = "its parameter curves leave the domain by " + format_real(fit.excursion);
    } catch (const InputError& error) {
      if (model.empty()) throw;
      flat.clear();
      trouble = error.what();
    }
  }
  if (!trouble.empty() && !model.empty()) {
    const double size = (s.points().rowwise().maxCoeff() - s.points().rowwise().minCoeff()).norm();
    const std::optional<AffinePatch> patch = affine_patch(s, 1e-9 * size);
    if (patch) {
      const std::vector<Curve2> pulled = pulled_back(model, *patch);
      const Fit old_fit = flat.empty() ? Fit{1, 1} : fit_of(flat, s), new_fit = fit_of(pulled, s);
      if (std::max(new_fit.gap, new_fit.excursion) < std::max(old_fit.gap, old_fit.excursion)) {
        flat = pulled;
        note(e, "pulled back", trouble + "; its model curve is pulled back onto the flat surface");
        mark(e, Disposition::converted, "parameter curves from the model curve");
        trouble.clear();
      }
    }
  }
  if (flat.empty())
    in.fail(trouble + ", and pulling the model curve back onto a curved surface is not possible yet");
  if (!trouble.empty()) note(e, "bad loop", trouble);
  mark(e, Disposition::read);

  TrimLoop out;
  const bool paired = model.size() == flat.size();
  if (!model.empty() && !paired)
    note(e, "segment counts", std::to_string(flat.size()) + " parameter curves and " + std::to_string(model.size()) +
                                  " model curves; the parameter curves are taken");
  for (std::size_t i = 0; i < flat.size(); ++i) {
    TrimCurve curve;
    curve.curve = std::move(flat[i]);
    curve.index = static_cast<int>(i);
    if (paired) curve.model = std::move(model[i].curve);
    out.curves.push_back(std::move(curve));
  }
  for (std::size_t i = 0; i < out.curves.size(); ++i)
    out.gap = std::max(out.gap, (out.curves[(i + 1) % out.curves.size()].curve.start() - out.curves[i].curve.end()).norm());
  return out;
}

// U0 to V1 say where an untrimmed surface ends. Where a loop bounds it the loop decides, and the surface keeps its own
// knots and net: several exporters put the loop's bounding box there.
NurbsSurface Reader::surface(const Entry& e, bool trimmed, std::string& name) {
  if (e.type != 128)
    throw InputError(file_.place(e) + "as a face's surface it is not read yet, must be 128");
  spend(e);
  Parameters in(file_, e, &notes_);
  const SplineSurface spline = read_spline_surface(in);
  name = name_property(in);
  NurbsSurface s = spline.surface;
  bool partial = !(spline.covers_domain());
  if (partial && trimmed) {
    note(e, "partial", "U0 to V1 name a part of the knots' domain; the face is trimmed, so the domain stays");
    partial = false;
  } else if (partial) {
    note(e, "restricted", "U0 to V1 name a part of the knots' domain; the surface is restricted to it");
    try {
      s = restricted(spline);
    } catch (const GeometryError& error) {
      in.fail(error.what());
    }
  }
  const Eigen::Affine3d t = transform(e);
  if (!is_identity(t)) s = s.with_points(t * s.points());
  mark(e, partial ? Disposition::converted : Disposition::read, partial ? "restricted to U0, U1, V0, V1" : "");
  return s;
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

TrimmedSurface Reader::face(const Entry& e) {
  Parameters in(file_, e, &notes_);
  const Face record = read_face(in);
  TrimmedSurface out;
  out.name = name_property(in);
  const Eigen::Affine3d t = transform(e);
  const Entry& support = entry(record.surface, e, "surface");
  std::string surface_name;
  out.surface = surface(support, record.outer != 0, surface_name);
  if (out.name.empty()) out.name = surface_name;
  if (!is_identity(t)) out.surface = out.surface.with_points(t * out.surface.points());
  if (record.outer_was_denied) note(e, "N1", "N1 is 0 though an outer boundary is given; the boundary is taken");
  if (record.outer != 0) {
    out.loops.push_back(loop(entry(record.outer, e, "outer boundary"), record.surface, out.surface, t));
  } else {
    out.loops.push_back(natural_loop(out.surface));
    out.natural_bounds = record.holes.empty();
  }
  for (int hole : record.holes) {
    out.loops.push_back(loop(entry(hole, e, "inner boundary"), record.surface, out.surface, t));
    out.loops.back().kind = LoopKind::hole;
  }
  for (std::size_t i = 0; i < out.loops.size(); ++i) out.loops[i].index = static_cast<int>(i);
  mark(e, Disposition::read);
  return out;
}

TrimmedSurface Reader::free_surface(const Entry& e) {
  TrimmedSurface out;
  out.surface = surface(e, false, out.name);
  out.loops.push_back(natural_loop(out.surface));
  out.natural_bounds = true;
  return out;
}

// Surfaces that another entity is made of. Groups and properties don't use what they name.
void Reader::find_used_surfaces(std::set<int>& used) {
  std::vector<int> doubtful;  // dependent by their status, though nobody known uses them
  for (const Entry& e : file_.entries) {
    int parameter = 0;  // where the pointer to a surface stands
    switch (e.type) {
      case 128:
        if (e.subordinate == 1 || e.subordinate == 3) doubtful.push_back(e.sequence);
        continue;
      case 144: case 510: parameter = 1; break;
      case 142: case 143: parameter = 2; break;
      case 141: parameter = 3; break;
      case 140: parameter = 5; break;
      default: continue;
    }
    try {
      Parameters in(file_, e);
      if (parameter >= in.size()) continue;
      const std::optional<int> pointer = parse_integer(in.token(parameter).text);
      if (pointer) used.insert(*pointer);
    } catch (const InputError&) {
      // The face itself is quarantined for this, with the message.
    }
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

void Reader::finish_panel(TrimmedSurface panel, const Entry& e) {
  panel.metres_per_unit = out_.metres_per_unit;
  panel.resolution = out_.resolution;
  panel.source = file_.name + ":" + std::to_string(e.line) + ": entity " + std::to_string(e.type);
  out_.panels.push_back(std::move(panel));
}

bool Reader::holds_faces() const {
  constexpr std::array<int, 19> types{108, 114, 118, 120, 122, 128, 140, 141, 142, 143, 144, 186, 190, 192, 194, 196, 198, 510, 514};
  return std::ranges::any_of(file_.entries, [&](const Entry& e) { return std::ranges::find(types, e.type) != types.end(); });
}

// A drawing without any face: closed plane outlines are panels. (iges.md, 12)
void Reader::read_outlines() {
  std::set<int> parts;  // of composite curves
  for (const Entry& e : file_.entries) {
    if (e.type != 102) continue;
    try {
      Parameters in(file_, e);
      for (const int sequence : read_composite(in)) parts.insert(sequence);
    } catch (const InputError&) {
      // Reported below, where the curve is read.
    }
  }
  std::map<std::string, int> labels;
  std::vector<LooseCurve> curves;
  std::vector<LoosePoint> points;
  for (const Entry& e : file_.entries) {
    const Kind* kind = find_kind(e.type);
    const bool curve = e.type == 102 || (kind && kind->curve);
    const bool copious_points = e.type == 106 && e.form >= 1 && e.form <= 3;
    const bool drawing = e.type == 106 && e.form >= 20 && e.form != 63;  // centre lines, hatching, witness lines
    if (parts.count(e.sequence) != 0 || drawing || !(curve || e.type == 116 || e.type == 212)) continue;
    try {
      Parameters in(file_, e, &notes_);
      const Eigen::Affine3d t = transform(e);
      const auto add_point = [&](const Eigen::Vector3d& at, const std::string& words) {
        points.push_back({e.sequence, e.label, t * at, words});
        mark(e, Disposition::read);
      };
      if (e.type == 116) {
        Eigen::Vector3d at;
        for (int axis = 0; axis < 3; ++axis) at[axis] = in.real("coordinate of the point");
        add_point(at, "");
      } else if (e.type == 212) {
        for (const NoteString& line : read_note(in)) add_point(line.at, line.text);
      } else if (copious_points) {
        const CopiousData data = read_copious(in);
        const std::size_t width = data.kind == 1 ? 2 : data.kind == 2 ? 3 : 6;
        for (std::size_t k = 0; k < data.numbers.size(); k += width)
          add_point({data.numbers[k], data.numbers[k + 1], data.kind == 1 ? data.height : data.numbers[k + 2]}, "");
      } else {
        LooseCurve loose{e.sequence, {}, {}};
        for (Piece& piece : this->curves(e.sequence, e, "curve")) loose.pieces.push_back(std::move(piece.curve));
        if (e.type != 102) kind->curve(in);  // moves to the pointers behind the parameters
        else read_composite(in);
        loose.name = name_property(in);
        if (loose.name.empty()) loose.name = e.label;
        ++labels[loose.name];
        curves.push_back(std::move(loose));
      }
    } catch (const Error& error) {
      mark(e, Disposition::quarantined, error.what());
      notes_.add("outline " + std::to_string(e.sequence), std::string(error.what()) + "; it is left out");
    }
  }
  if (curves.empty()) return;
  Outlines found = find_outlines(std::move(curves), points, out_.resolution);
  for (const OutlineNote& n : found.notes) note(*file_.find(n.id), n.what.substr(0, n.what.find_first_of("0123456789(")), n.what);
  for (std::size_t k = 0; k < found.panels.size(); ++k) {
    TrimmedSurface& panel = found.panels[k];
    const Entry& e = *file_.find(found.ids[k]);
    // A label that every entity carries ("LINE", "COMPCURV") is no name.
    labels_.push_back({});
    if (labels[panel.name] > 1) panel.name.clear();
    finish_panel(std::move(panel), e);
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
    if (!find_kind(e.type)) ++unread[e.type];
    out_.ledger.push_back({e.sequence, e.line, e.type, e.form, Disposition::kept, {}});
  }

  std::set<int> used;
  find_used_surfaces(used);
  std::string first_failure;
  for (const Entry& e : file_.entries) {
    const bool is_face = e.type == 144;
    if (!is_face && !(e.type == 128 && used.count(e.sequence) == 0)) continue;
    try {
      finish_panel(is_face ? face(e) : free_surface(e), e);
      labels_.push_back(e.label);
    } catch (const InputError& error) {
      // Its parts may be read; the face is not there.
      out_.ledger[static_cast<std::size_t>((e.sequence - 1) / 2)].disposition = Disposition::quarantined;
      out_.ledger[static_cast<std::size_t>((e.sequence - 1) / 2)].why = error.what();
      notes_.add("quarantine " + std::to_string(e.sequence), std::string(error.what()) + " (face of directory entry " +
                                                                  std::to_string(e.sequence) + " is left out)");
      if (first_failure.empty()) first_failure = error.what();
    }
  }
  if (out_.panels.empty() && !first_failure.empty()) throw InputError(first_failure);
  if (!holds_faces()) read_outlines();
  finish_names();
  out_.warnings = notes_.list();
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
