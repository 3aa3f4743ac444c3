// SPDX-License-Identifier: GPL-3.0-or-later
// Faces to records. Parameter curves are written as they are; model curves are made anew from the surface.
#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <map>

#include "geometry/error.h"
#include "io/iges.h"
#include "io/iges/cards.h"
#include "io/iges/entity.h"
#include "io/iges/marks.h"
#include "io/iges/model_curve.h"
#include "io/iges/topology.h"

namespace toile {

namespace iges {
namespace {

// Model curves follow the surface to this fraction of the face's size: 1e-5 mm on a garment panel of a metre.
constexpr double curve_tolerance = 1e-8;

constexpr const char* independent = "00000000";
constexpr const char* dependent = "00010000";
constexpr const char* parametric = "00010500";
constexpr const char* definition = "00000200";
constexpr const char* annotation = "00000100";
constexpr double text_height = 0.02;  // of the face's size

class FaceWriter {
 public:
  explicit FaceWriter(std::vector<OutRecord>& records) : records_(records) {}
  // Returns the number of what stands for the face: its own, or that of the group of the face and its marks.
  int add(const OutputFace& output);
  void name_level(int level, const std::string& words);
  void group(const std::vector<int>& members, const std::string& words);
  double largest_fit() const { return largest_fit_; }

 private:
  // Appends the record; returns its directory number.
  int add(const Card& card, Record& record) {
    records_.push_back({make_cards(card), record.finish()});
    return 2 * static_cast<int>(records_.size()) - 1;
  }
  template <class T>
  int add(const Card& card, const T& entity) {
    Record record(card.type);
    write(entity, record);
    return add(card, record);
  }
  int curve(const Curve3& c, const char* status);
  int add_named(const Card& card, Record& record, int name_number);
  struct CurvePair {
    Curve3 parameter, model;
  };
  CurvePair curve_pair(const Curve2& c, const NurbsSurface& surface, const std::optional<AffinePatch>& patch,
                       double tolerance);
  int chain(const std::vector<int>& curves, const char* status);
  int boundary(const TrimLoop& loop, const NurbsSurface& surface, int surface_number,
               const std::optional<AffinePatch>& patch, double tolerance);
  int colour(const std::array<double, 3>& rgb);
  int moved_aside(const Eigen::Vector3d& by);
  int name(const std::string& words);
  int marks(const OutputFace& output, int face_number, int surface_number, const std::optional<AffinePatch>& patch,
            double size);

  std::vector<OutRecord>& records_;
  std::map<std::array<double, 3>, int> colours_, asides_;
  double largest_fit_ = 0;
};

int FaceWriter::curve(const Curve3& c, const char* status) {
  return add({.type = 126, .status = status}, SplineCurve{c, c.domain()});
}

int FaceWriter::chain(const std::vector<int>& curves, const char* status) {
  if (curves.size() == 1) return curves[0];
  Record record(102);
  write_composite(curves, record);
  return add({.type = 102, .status = status}, record);
}

int FaceWriter::colour(const std::array<double, 3>& rgb) {
  const auto found = colours_.find(rgb);
  if (found != colours_.end()) return found->second;
  const Colour entity{100 * rgb[0], 100 * rgb[1], 100 * rgb[2], {}};
  return colours_[rgb] = add({.type = 314, .status = definition}, entity);
}

// The number of the transformation, 0 for none.
int FaceWriter::moved_aside(const Eigen::Vector3d& by) {
  if (by.isZero(0)) return 0;
  const std::array<double, 3> key{by.x(), by.y(), by.z()};
  const auto found = asides_.find(key);
  if (found != asides_.end()) return found->second;
  const Eigen::Affine3d move(Eigen::Translation3d{by});
  return asides_[key] = add({.type = 124, .label = aside_label, .status = dependent}, move);
}

// The curves in the file's order and direction. A loop that is traversed against it has all its curves reversed; a
// curve that alone runs against its loop is turned, so that what is written is head to tail.
std::vector<Curve2> in_file_order(const TrimLoop& loop) {
  std::vector<const TrimCurve*> curves;
  for (const TrimCurve& c : loop.curves) curves.push_back(&c);
  const auto against = std::count_if(curves.begin(), curves.end(), [](const TrimCurve* c) { return c->reversed; });
  const bool backwards = 2 * static_cast<std::size_t>(against) > curves.size();
  if (backwards) std::reverse(curves.begin(), curves.end());
  const auto first = std::min_element(curves.begin(), curves.end(),
                                      [](const TrimCurve* a, const TrimCurve* b) { return a->index < b->index; });
  std::rotate(curves.begin(), first, curves.end());
  std::vector<Curve2> out;
  for (const TrimCurve* c : curves) out.push_back(c->reversed == backwards ? c->curve : reversed(c->curve));
  return out;
}

FaceWriter::CurvePair FaceWriter::curve_pair(const Curve2& c, const NurbsSurface& surface,
                                             const std::optional<AffinePatch>& patch, double tolerance) {
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, c.points().cols());
  points.topRows<2>() = c.points();
  ModelCurve model = fit_model_curve(surface, c, tolerance, patch);
  largest_fit_ = std::max(largest_fit_, model.error);
  return {Curve3(c.knots(), std::move(points), c.weights()), std::move(model.curve)};
}

int FaceWriter::boundary(const TrimLoop& loop, const NurbsSurface& surface, int surface_number,
                         const std::optional<AffinePatch>& patch, double tolerance) {
  std::vector<int> parameter_curves, model_curves;
  std::vector<CurvePair> pairs;
  for (const Curve2& c : in_file_order(loop)) pairs.push_back(curve_pair(c, surface, patch, tolerance));
  for (const CurvePair& pair : pairs) parameter_curves.push_back(curve(pair.parameter, parametric));
  const int parameter_chain = chain(parameter_curves, parametric);
  for (const CurvePair& pair : pairs) model_curves.push_back(curve(pair.model, dependent));
  const int model_chain = chain(model_curves, dependent);
  return add({.type = 142, .status = dependent}, Boundary{.creation = 0,
                                                          .surface = surface_number,
                                                          .parameter_curve = parameter_chain,
                                                          .model_curve = model_chain,
                                                          .preference = 1});
}

int FaceWriter::add(const OutputFace& output) {
  const TrimmedSurface& face = output.face;
  const NurbsSurface& s = face.surface;
  const std::string& words = output.name.empty() ? face.name : output.name;
  const int colour_number = output.colour ? -colour(*output.colour) : 0;
  const int name_number = words.empty() ? 0 : name(words);
  const int aside = moved_aside(output.aside);
  const SplineSurface spline{s, s.u().domain(), s.v().domain()};
  // A face without a trim is the surface itself, free-standing; with marks on it, it can't be.
  if (face.natural_bounds && face.marks.empty()) {
    Record record(128);
    write(spline, record);
    return add_named(
        {.type = 128, .level = output.level, .colour = colour_number, .transform = aside, .status = independent},
        record, name_number);
  }
  const double size = (s.points().rowwise().maxCoeff() - s.points().rowwise().minCoeff()).norm();
  const std::optional<AffinePatch> patch = affine_patch(s, 0.1 * curve_tolerance * size);
  const int surface_number = add({.type = 128, .status = dependent}, spline);
  std::vector<const TrimLoop*> loops;
  for (const TrimLoop& loop : face.loops) loops.push_back(&loop);
  std::stable_sort(loops.begin(), loops.end(), [](const TrimLoop* a, const TrimLoop* b) {
    return a->kind != b->kind ? a->kind == LoopKind::outer : a->index < b->index;
  });
  Face record_of_face;
  record_of_face.surface = surface_number;
  for (const TrimLoop* loop : loops) {
    const int number = boundary(*loop, s, surface_number, patch, curve_tolerance * size);
    if (loop->kind == LoopKind::outer && record_of_face.outer == 0) {
      record_of_face.outer = number;
    } else {
      record_of_face.holes.push_back(number);
    }
  }
  Record record(144);
  write(record_of_face, record);
  const int face_number = add_named(
      {.type = 144, .level = output.level, .colour = colour_number, .transform = aside, .status = independent}, record,
      name_number);
  return face.marks.empty() ? face_number : marks(output, face_number, surface_number, patch, size);
}

void FaceWriter::name_level(int level, const std::string& words) {
  Record record(406);
  write_level_function(words, record);
  add({.type = 406, .form = 3, .level = level, .status = definition}, record);
}

void FaceWriter::group(const std::vector<int>& members, const std::string& words) {
  const int name_number = words.empty() ? 0 : name(words);
  Record record(402);
  write_group(members, 7, record);
  add_named({.type = 402, .form = 7, .status = independent}, record, name_number);
}

int FaceWriter::name(const std::string& words) {
  Record record(406);
  write_name(words, record);
  return add({.type = 406, .form = 15, .status = dependent}, record);
}

int FaceWriter::add_named(const Card& card, Record& record, int name_number) {
  // No associativities, one property.
  if (name_number != 0) record.integer(0).integer(1).integer(name_number);
  return add(card, record);
}

int FaceWriter::marks(const OutputFace& output, int face_number, int surface_number,
                      const std::optional<AffinePatch>& patch, double size) {
  const NurbsSurface& s = output.face.surface;
  std::vector<int> members{face_number};
  const int aside = moved_aside(output.aside);
  for (const PanelMark& mark : output.face.marks) {
    if (mark.curve) {
      const int label = name(label_of(mark));
      Record record(142);
      const auto [parameter_curve, model_curve] = curve_pair(*mark.curve, s, patch, curve_tolerance * size);
      write(Boundary{.creation = 0,
                     .surface = surface_number,
                     .parameter_curve = curve(parameter_curve, parametric),
                     .model_curve = curve(model_curve, dependent),
                     .preference = 1},
            record);
      members.push_back(
          add_named({.type = 142, .level = output.level, .transform = aside, .status = independent}, record, label));
    } else if (mark.kind == MarkKind::text) {
      Record record(212);
      write(NoteString{s(mark.at.x(), mark.at.y()), mark.text}, text_height * size, record);
      members.push_back(add({.type = 212, .level = output.level, .transform = aside, .status = annotation}, record));
    } else {
      const int label = name(label_of(mark));
      Record record(116);
      write(PlacePoint{s(mark.at.x(), mark.at.y()), 0}, record);
      members.push_back(
          add_named({.type = 116, .level = output.level, .transform = aside, .status = independent}, record, label));
    }
  }
  Record record(402);
  write_group(members, 7, record);
  return add({.type = 402, .form = 7, .level = output.level, .status = independent}, record);
}

// YYYYMMDD.HHNNSS in UTC of a Unix time.
std::string format_date(long long seconds) {
  using namespace std::chrono;
  const sys_seconds time{std::chrono::seconds(seconds)};
  const sys_days day = floor<days>(time);
  const year_month_day date(day);
  const hh_mm_ss clock(time - day);
  auto digits = [](long long value, std::size_t width) {
    std::string text = std::to_string(value);
    return text.size() < width ? std::string(width - text.size(), '0') + text : text;
  };
  return digits(static_cast<int>(date.year()), 4) + digits(static_cast<unsigned>(date.month()), 2) +
         digits(static_cast<unsigned>(date.day()), 2) + "." + digits(clock.hours().count(), 2) +
         digits(clock.minutes().count(), 2) + digits(clock.seconds().count(), 2);
}

std::string date_of(const IgesHeader& header) {
  if (header.date) return *header.date;
  const char* epoch = std::getenv("SOURCE_DATE_EPOCH");
  constexpr int last = 2147483647;
  const int seconds = epoch ? parse_integer(epoch).value_or(0) : 0;
  return format_date(std::clamp(seconds, 0, last));
}

std::string global_section(const IgesHeader& header, const Unit& unit, double scale, double resolution,
                           double largest) {
  const std::string date = date_of(header);
  Record g = Record::global();
  g.string(header.product).string(header.product + ".igs").string("toile").string("toile");
  g.integer(32).integer(308).integer(15).integer(308).integer(15);
  g.string(header.product).real(scale).integer(unit.flag).string(unit.name).integer(1).real(0);
  g.string(date).real(resolution).real(largest).string("toile").blank().integer(11).integer(0).string(date);
  return g.finish();
}

}  // namespace
}  // namespace iges

IgesOutput format_iges(std::span<const OutputFace> faces, const IgesHeader& header) {
  using namespace iges;
  const std::optional<Unit> unit = unit_of_name(header.unit);
  if (!unit) throw GeometryError("'" + header.unit + "' is no length unit of IGES");
  double scale = 1, largest = 0;
  std::vector<OutRecord> records;
  std::vector<int> members;
  FaceWriter writer(records);
  for (const OutputFace& face : faces) {
    // Sources with a model scale other than 1 keep their numbers, so the scale must be said again.
    const double ratio = unit->metres / face.face.metres_per_unit;
    const double own = std::abs(ratio - 1) <= 1e-12 ? 1 : ratio;
    if (&face == &faces.front()) scale = own;
    if (own != scale) throw GeometryError("face '" + face.name + "' has another unit than the faces before it");
    largest = std::max(largest, face.face.surface.points().cwiseAbs().maxCoeff());
    members.push_back(writer.add(face));
  }
  for (const auto& [level, words] : header.levels) writer.name_level(level, words);
  if (members.size() > 1) writer.group(members, header.product);
  IgesOutput out;
  out.largest_curve_fit = writer.largest_fit();
  const double resolution = std::max(header.resolution, out.largest_curve_fit);
  std::vector<std::string> start;
  if (header.up) start.push_back(up_line(*header.up));
  out.text = assemble(start, global_section(header, *unit, scale, resolution, largest), records);
  return out;
}

}  // namespace toile
