// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/iges/curve_reading.h"

#include <algorithm>
#include <optional>

#include "geometry/error.h"
#include "geometry/refine.h"
#include "io/iges/entity.h"

namespace toile::iges {

namespace {

NaturalCurve natural_curve(Reading& reading, const Entry& e, int depth);

// The curves of a composite; points (116, 132) may mark its joints. [IGES 5.3, 4.4]
std::vector<const Entry*> parts_of(Reading& reading, const Entry& e, Parameters& in) {
  std::vector<const Entry*> out;
  for (const int sequence : read_composite(in)) {
    const Entry& part = reading.entry(sequence, e, "curve");
    if (part.type != 116 && part.type != 132) out.push_back(&part);
  }
  return out;
}

Curve3 offset_curve(Reading& reading, const Entry& e, int depth) {
  Parameters in(reading.file, e, &reading.notes);
  const OffsetCurve record = read_offset_curve(in);
  const Curve3 base = natural_curve(reading, reading.entry(record.curve, e, "curve to offset"), depth + 1).curve;
  std::optional<Curve3> function;
  if (record.flag == 3)
    function = natural_curve(reading, reading.entry(record.function, e, "function of the offset"), depth + 1).curve;
  const double size = (base.points().rowwise().maxCoeff() - base.points().rowwise().minCoeff()).norm();
  FittedCurve fitted = to_curve(record, base, function ? &*function : nullptr, reading.fit_tolerance(size));
  reading.mark(e, Disposition::converted, "offset curve as cubic B-spline, off by " + format_real(fitted.error));
  return std::move(fitted.curve);
}

void append_curves(Reading& reading, const Entry& e, std::vector<Curve3>& out, int depth) {
  if (depth > max_depth) throw InputError(reading.file.place(e) + "its curves form a cycle");
  const Kind* kind = find_kind(e.type);
  const std::size_t first = out.size();
  reading.spend(e);
  if (e.type == 102) {
    Parameters in(reading.file, e, &reading.notes);
    for (const Entry* part : parts_of(reading, e, in)) append_curves(reading, *part, out, depth + 1);
    // Shared curves inside shared composites could multiply without end.
    if (out.size() > 4 * reading.file.entries.size() + 16)
      throw InputError(reading.file.place(e) + "it repeats its curves too often");
    reading.mark(e, Disposition::read);
  } else if (e.type == 130) {
    try {
      out.push_back(offset_curve(reading, e, depth));
    } catch (const GeometryError& error) {
      throw InputError(reading.file.place(e) + error.what());
    }
  } else if (kind && kind->curve) {
    Parameters in(reading.file, e, &reading.notes);
    try {
      out.push_back(kind->curve(in));
    } catch (const GeometryError& error) {
      in.fail(error.what());
    }
    reading.mark(e, kind->converted ? Disposition::converted : Disposition::read,
                 kind->converted ? std::string(kind->name) + " as B-spline curve" : std::string());
  } else {
    throw InputError(reading.file.place(e) +
                     "as a boundary curve it is not read, must be 100, 102, 104, 106, 110, 112, 126 or 130");
  }
  const Eigen::Affine3d t = reading.transform(e);
  for (std::size_t i = first; i < out.size(); ++i) out[i] = transformed(t, out[i]);
}

NaturalCurve natural_curve(Reading& reading, const Entry& e, int depth) {
  if (depth > max_depth) throw InputError(reading.file.place(e) + "its curves form a cycle");
  const Eigen::Affine3d t = reading.transform(e);
  NaturalCurve out;
  if (e.type == 102) {
    reading.spend(e);
    Parameters in(reading.file, e, &reading.notes);
    std::vector<NaturalCurve> pieces;
    for (const Entry* part : parts_of(reading, e, in)) {
      pieces.push_back(natural_curve(reading, *part, depth + 1));
      if (pieces.size() > 4 * reading.file.entries.size() + 16)
        throw InputError(reading.file.place(e) + "it repeats its curves too often");
    }
    double size = 0;
    for (const NaturalCurve& piece : pieces) size = std::max(size, piece.curve.points().cwiseAbs().maxCoeff());
    try {
      out = joined(pieces, std::max(reading.file.global.resolution, 1e-6 * size));
    } catch (const GeometryError& error) {
      in.fail(error.what());
    }
    reading.mark(e, Disposition::read);
  } else {
    std::vector<Curve3> one;
    append_curves(reading, e, one, depth);
    out.curve = one.at(0);
    if (e.type == 100) {
      Parameters in(reading.file, e);
      const Interval angles = arc_angles(read_arc(in));
      out.curve = with_domain(out.curve, angles);
      out.turns = {{angles, (out.curve.knots().control_point_count() - 1) / 2, angles.length()}};
    }
    return out;  // the transformation is in it
  }
  out.curve = transformed(t, out.curve);
  return out;
}

}  // namespace

std::vector<Curve3> curves_of(Reading& reading, int sequence, const Entry& from, const char* role) {
  std::vector<Curve3> out;
  append_curves(reading, reading.entry(sequence, from, role), out, 0);
  return out;
}

NaturalCurve natural_curve_of(Reading& reading, const Entry& e) {
  return natural_curve(reading, e, 0);
}

}  // namespace toile::iges
