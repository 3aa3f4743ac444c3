// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/iges/marks.h"

#include <algorithm>
#include <array>

#include "geometry/error.h"
#include "geometry/measure.h"
#include "geometry/refine.h"
#include "io/iges/curve_reading.h"
#include "io/iges/entity.h"

namespace toile::iges {

namespace {

constexpr std::array kinds{MarkKind::grain, MarkKind::notch, MarkKind::drill, MarkKind::line,
                           MarkKind::text,  MarkKind::sew,   MarkKind::slit};

// The kind and the words of a label; other words are those of a line or a drill hole.
void apply_label(const std::string& label, PanelMark& mark) {
  mark.kind = mark.curve ? MarkKind::line : MarkKind::drill;
  mark.text = label;
  for (const MarkKind kind : kinds) {
    const std::string word = name(kind);
    if (label != word && !label.starts_with(word + ": ")) continue;
    mark.kind = kind;
    mark.text = label == word ? std::string() : label.substr(word.size() + 2);
  }
}

class MarkReader {
 public:
  MarkReader(Reading& reading, TrimmedSurface& panel) : reading_(reading), panel_(panel) {
    const auto& points = panel.surface.points();
    size_ = (points.rowwise().maxCoeff() - points.rowwise().minCoeff()).norm();
    patch_ = affine_patch(panel.surface, 1e-9 * size_);
  }

  void read(const Entry& e) {
    Parameters in(reading_.file, e, &reading_.notes);
    const Kind* kind = find_kind(e.type);
    if (e.type == 142) {
      const Boundary boundary = read_boundary(in);
      std::vector<Curve3> curves = curves_of(reading_, boundary.parameter_curve, e, "parameter curve");
      // Only so that the ledger says what became of it.
      if (boundary.model_curve != 0) curves_of(reading_, boundary.model_curve, e, "model curve");
      if (curves.size() == 1)
        add_curve(e, in, Curve2(curves[0].knots(), curves[0].points().topRows<2>(), curves[0].weights()));
    } else if (kind && kind->curve) {
      const std::vector<Curve3> curves = curves_of(reading_, e.sequence, e, "curve");
      kind->curve(in);
      if (const std::optional<Curve2> flat = in_parameters(curves.at(0))) add_curve(e, in, *flat);
    } else if (e.type == 116) {
      PanelMark mark;
      mark.at = place(reading_.transform(e) * read_point(in).x);
      apply_label(reading_.name_property(in), mark);
      add(e, std::move(mark));
    } else if (e.type == 212) {
      for (const NoteString& line : read_note(in)) {
        PanelMark mark;
        mark.kind = MarkKind::text;
        mark.at = place(reading_.transform(e) * line.at);
        mark.text = line.text;
        add(e, std::move(mark));
      }
    }
  }

 private:
  void add(const Entry& e, PanelMark mark) {
    panel_.marks.push_back(std::move(mark));
    reading_.mark(e, Disposition::read);
  }
  void add_curve(const Entry& e, Parameters& in, Curve2 curve) {
    PanelMark mark;
    mark.at = curve.start();
    mark.curve = std::move(curve);
    apply_label(reading_.name_property(in), mark);
    add(e, std::move(mark));
  }
  Eigen::Vector2d place(const Eigen::Vector3d& x) const {
    if (patch_) return parameters_at(*patch_, x);
    const ClosestPoint c = closest_point(panel_.surface, x);
    return {c.u, c.v};
  }
  // Of a curve that lies on a flat panel.
  std::optional<Curve2> in_parameters(const Curve3& curve) const {
    if (!patch_) return std::nullopt;
    Curve2::Points points(2, curve.points().cols());
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      const Eigen::Vector2d uv = parameters_at(*patch_, curve.points().col(i));
      const Eigen::Vector3d x = patch_->origin + patch_->du * uv.x() + patch_->dv * uv.y();
      if ((x - curve.points().col(i)).norm() > std::max(panel_.resolution, 1e-6 * size_)) return std::nullopt;
      points.col(i) = uv;
    }
    return Curve2(curve.knots(), std::move(points), curve.weights());
  }

  Reading& reading_;
  TrimmedSurface& panel_;
  double size_ = 0;
  std::optional<AffinePatch> patch_;
};

}  // namespace

std::string label_of(const PanelMark& mark) {
  return name(mark.kind) + (mark.text.empty() ? std::string() : ": " + mark.text);
}

void read_marks(Reading& reading, std::span<const Entry* const> faces, std::span<TrimmedSurface> panels) {
  for (const Entry& group : reading.file.entries) {
    if (!is_group(group)) continue;
    try {
      Parameters in(reading.file, group);
      std::vector<const Entry*> marks;
      std::vector<std::size_t> held;
      for (const int member : read_group(in)) {
        const Entry* e = reading.file.find(member);
        const auto face = std::ranges::find(faces, e);
        if (face != faces.end()) {
          held.push_back(static_cast<std::size_t>(face - faces.begin()));
        } else if (e) {
          marks.push_back(e);
        }
      }
      if (held.size() != 1 || marks.empty()) continue;
      MarkReader reader(reading, panels[held[0]]);
      for (const Entry* e : marks) {
        try {
          reader.read(*e);
        } catch (const Error& error) {
          reading.note(*e, "mark", std::string("it can't be read: ") + error.what());
        }
      }
    } catch (const Error& error) {
      reading.note(group, "marks", std::string("its marks can't be read: ") + error.what());
    }
  }
}

}  // namespace toile::iges
