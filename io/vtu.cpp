// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/vtu.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <stdexcept>
#include <type_traits>

#include "geometry/refine.h"
#include "geometry/text.h"
#include "io/file.h"
#include "io/polyline.h"
#include "io/vtu_arrays.h"
#include "io/xml_text.h"

namespace toile {

namespace {

// Cell types of VTK.
constexpr std::uint8_t vtk_vertex = 1, vtk_line = 3, vtk_poly_line = 4, vtk_triangle = 5, vtk_bezier_quad = 77;

// The arrays of one section (PointData, Cells, ...), in the order in which they came.
template <class T>
struct Array {
  std::string name;
  int components = 1;
  std::vector<T> values;
};

// One unstructured grid on its way into a file.
struct Grid {
  std::vector<Eigen::Vector3d> points;
  std::vector<std::int32_t> connectivity, offsets;
  std::vector<std::uint8_t> types;
  std::vector<Array<double>> point_reals, cell_reals;
  std::vector<Array<float>> point_fields;
  std::vector<Array<std::int32_t>> point_integers, cell_integers;
  std::string point_attributes, cell_attributes;  // which array plays which part

  void close_cell(std::uint8_t type) {
    offsets.push_back(static_cast<std::int32_t>(connectivity.size()));
    types.push_back(type);
  }
  void add_point(const Eigen::Vector3d& x) { points.push_back(x); }
  std::int32_t next_point() const { return static_cast<std::int32_t>(points.size()); }
};

// XML head with offsets, and behind it the compressed arrays.
class Writer {
 public:
  std::string finish(const Grid& grid, double time) {
    head_ =
        "<?xml version=\"1.0\"?>\n"
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" " +
        std::string(vtu_storage) +
        ">\n"
        "<UnstructuredGrid>\n<FieldData>\n<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" "
        "format=\"ascii\">" +
        text(time) +
        "</DataArray>\n</FieldData>\n"
        "<Piece NumberOfPoints=\"" +
        std::to_string(grid.points.size()) + "\" NumberOfCells=\"" + std::to_string(grid.types.size()) + "\">\n";
    section("PointData", grid.point_attributes, grid.point_fields, grid.point_reals, grid.point_integers);
    section("CellData", grid.cell_attributes, grid.cell_reals, grid.cell_integers);
    head_ += "<Points>\n";
    array("Points", 3, reinterpret_cast<const double*>(grid.points.data()), 3 * grid.points.size());
    head_ += "</Points>\n<Cells>\n";
    array("connectivity", 1, grid.connectivity.data(), grid.connectivity.size());
    array("offsets", 1, grid.offsets.data(), grid.offsets.size());
    array("types", 1, grid.types.data(), grid.types.size());
    head_ += "</Cells>\n</Piece>\n</UnstructuredGrid>\n" + std::string(vtu_data_mark);
    return std::move(head_) + body_ + "\n</AppendedData>\n</VTKFile>\n";
  }

 private:
  template <class T>
  static const char* type_name() {
    if constexpr (std::is_same_v<T, double>) return "Float64";
    if constexpr (std::is_same_v<T, float>) return "Float32";
    if constexpr (std::is_same_v<T, std::int32_t>) return "Int32";
    if constexpr (std::is_same_v<T, std::uint8_t>) return "UInt8";
  }

  template <class T>
  void array(const std::string& name, int components, const T* values, std::size_t count) {
    append_vtu_array(head_, body_, type_name<T>(), name, components,
                     {reinterpret_cast<const char*>(values), count * sizeof(T)});
  }

  template <class... Arrays>
  void section(const std::string& name, const std::string& attributes, const Arrays&... arrays) {
    head_ += '<' + name + attributes + ">\n";
    const auto each = [&](const auto& list) {
      for (const auto& a : list) array(a.name, a.components, a.values.data(), a.values.size());
    };
    (each(arrays), ...);
    head_ += "</" + name + ">\n";
  }

  std::string head_, body_;
};

template <class T, class Vector>
void append(std::vector<T>& to, const Vector& x) {
  for (const double value : x) to.push_back(static_cast<T>(value));
}

// The order in which VTK wants the control points of a quadrilateral: corners, edges v = 0, u = 1, v = 1, u = 0 (each
// along its parameter), then the inside, u fastest. Entries are indices with u fastest.
std::vector<int> vtk_order(int p, int q) {
  const auto at = [p](int i, int j) { return i + (p + 1) * j; };
  std::vector<int> order{at(0, 0), at(p, 0), at(p, q), at(0, q)};
  for (int i = 1; i < p; ++i) order.push_back(at(i, 0));
  for (int j = 1; j < q; ++j) order.push_back(at(p, j));
  for (int i = 1; i < p; ++i) order.push_back(at(i, q));
  for (int j = 1; j < q; ++j) order.push_back(at(0, j));
  for (int j = 1; j < q; ++j)
    for (int i = 1; i < p; ++i) order.push_back(at(i, j));
  return order;
}

bool all_panels_have_velocity(const Frame& frame) {
  for (const FramePanel& panel : frame.panels)
    if (panel.velocity.cols() != panel.surface->points().cols()) return false;
  return true;
}

Grid surface_block(const Frame& frame) {
  Grid grid;
  const bool moving = all_panels_have_velocity(frame);
  Array<double> weights{"RationalWeights", 1, {}}, degrees{"HigherOrderDegrees", 3, {}};
  Array<float> velocity{"velocity", 3, {}};
  Array<std::int32_t> panel_number{"panel", 1, {}};
  for (std::size_t k = 0; k < frame.panels.size(); ++k) {
    const FramePanel& panel = frame.panels[k];
    const std::vector<BezierPatch> patches = bezier_patches(*panel.surface);
    // Velocity is a combination of the same functions, hence extracted like a net.
    std::vector<BezierPatch> velocities;
    if (moving) velocities = bezier_patches(panel.surface->with_points(panel.velocity));
    for (std::size_t b = 0; b < patches.size(); ++b) {
      const BezierPatch& patch = patches[b];
      // A quadrilateral of degree 0 in one direction does not exist; such a surface has no picture.
      if (patch.degree_u < 1 || patch.degree_v < 1) continue;
      for (const int c : vtk_order(patch.degree_u, patch.degree_v)) {
        grid.connectivity.push_back(grid.next_point());
        grid.add_point(patch.points.col(c));
        weights.values.push_back(patch.weights[c]);
        if (moving) append(velocity.values, Eigen::Vector3d(velocities[b].points.col(c)));
      }
      grid.close_cell(vtk_bezier_quad);
      degrees.values.insert(degrees.values.end(), {double(patch.degree_u), double(patch.degree_v), 0.0});
      panel_number.values.push_back(static_cast<std::int32_t>(k));
    }
  }
  grid.point_attributes = " RationalWeights=\"RationalWeights\"";
  grid.cell_attributes = " HigherOrderDegrees=\"HigherOrderDegrees\"";
  grid.point_reals.push_back(std::move(weights));
  if (moving) grid.point_fields.push_back(std::move(velocity));
  grid.cell_reals.push_back(std::move(degrees));
  grid.cell_integers.push_back(std::move(panel_number));
  return grid;
}

// One scalar array per component; absent unless every panel knows the field.
template <int N>
void add_field(Grid& grid, const Frame& frame, std::vector<Eigen::Matrix<double, N, 1>> FrameFields::*field,
               const std::array<const char*, N>& names) {
  for (const FramePanel& panel : frame.panels)
    if ((panel.fields.*field).size() != panel.triangles->uv.size()) return;
  for (int c = 0; c < N; ++c) {
    Array<float> out{names[static_cast<std::size_t>(c)], 1, {}};
    for (const FramePanel& panel : frame.panels)
      for (const auto& value : panel.fields.*field) out.values.push_back(static_cast<float>(value[c]));
    grid.point_fields.push_back(std::move(out));
  }
}

// The larger of weft and warp strain, as preview.png shows it: the active scalars, so that programs which colour what
// they open by these show strain at once.
void add_strain(Grid& grid, const Frame& frame) {
  Array<float> strain{"strain", 1, {}};
  for (const FramePanel& panel : frame.panels) {
    if (panel.fields.strain.size() != panel.triangles->uv.size()) return;
    for (const Eigen::Vector3d& e : panel.fields.strain)
      strain.values.push_back(static_cast<float>(std::max(e[0], e[1])));
  }
  grid.point_fields.push_back(std::move(strain));
  grid.point_attributes = " Scalars=\"strain\"";
}

Grid triangle_block(const Frame& frame) {
  Grid grid;
  const bool moving = all_panels_have_velocity(frame);
  Array<float> normal{"normal", 3, {}}, velocity{"velocity", 3, {}};
  Array<double> uv{"uv", 2, {}};
  Array<std::int32_t> panel_number{"panel", 1, {}};
  SurfaceBasis basis;
  for (std::size_t k = 0; k < frame.panels.size(); ++k) {
    const FramePanel& panel = frame.panels[k];
    const NurbsSurface& surface = *panel.surface;
    const std::int32_t first = grid.next_point();
    for (const Eigen::Vector2d& p : panel.triangles->uv) {
      evaluate_basis(surface, p[0], p[1], basis);
      Eigen::Vector3d x = Eigen::Vector3d::Zero(), xu = x, xv = x, xt = x;
      for (int b = 0; b < basis.count_v; ++b)
        for (int a = 0; a < basis.count_u; ++a) {
          const auto e = static_cast<std::size_t>(a + basis.count_u * b);
          const int c = surface.index(basis.first_u + a, basis.first_v + b);
          x += basis.value[0][e] * surface.points().col(c);
          xu += basis.value[1][e] * surface.points().col(c);
          xv += basis.value[2][e] * surface.points().col(c);
          if (moving) xt += basis.value[0][e] * panel.velocity.col(c);
        }
      grid.add_point(x);
      const Eigen::Vector3d n = xu.cross(xv);
      append(normal.values, Eigen::Vector3d(n.stableNormalized()));
      append(uv.values, p);
      if (moving) append(velocity.values, xt);
    }
    for (const std::array<int, 3>& triangle : panel.triangles->triangles) {
      for (const int vertex : triangle) grid.connectivity.push_back(first + vertex);
      grid.close_cell(vtk_triangle);
      panel_number.values.push_back(static_cast<std::int32_t>(k));
    }
  }
  add_strain(grid, frame);
  grid.point_attributes += " Normals=\"normal\"";
  add_field<3>(grid, frame, &FrameFields::strain, {"strain_weft", "strain_warp", "strain_shear"});
  add_field<3>(grid, frame, &FrameFields::second_pk, {"second_pk_weft", "second_pk_warp", "second_pk_shear"});
  add_field<2>(grid, frame, &FrameFields::nominal, {"nominal_stress_weft", "nominal_stress_warp"});
  add_field<3>(grid, frame, &FrameFields::curvature, {"curvature_weft", "curvature_warp", "curvature_twist"});
  grid.point_fields.push_back(std::move(normal));
  if (moving) grid.point_fields.push_back(std::move(velocity));
  grid.point_reals.push_back(std::move(uv));
  grid.cell_integers.push_back(std::move(panel_number));
  return grid;
}

Grid net_block(const Frame& frame) {
  Grid grid;
  Array<double> weight{"weight", 1, {}};
  Array<std::int32_t> cloth{"carries_cloth", 1, {}}, place{"ij", 2, {}}, panel_number{"panel", 1, {}};
  for (std::size_t k = 0; k < frame.panels.size(); ++k) {
    const FramePanel& panel = frame.panels[k];
    const NurbsSurface& surface = *panel.surface;
    const std::int32_t first = grid.next_point();
    const auto line = [&](int a, int b) {
      grid.connectivity.insert(grid.connectivity.end(), {first + a, first + b});
      grid.close_cell(vtk_line);
      panel_number.values.push_back(static_cast<std::int32_t>(k));
    };
    for (int j = 0; j < surface.count_v(); ++j)
      for (int i = 0; i < surface.count_u(); ++i) {
        const int c = surface.index(i, j);
        grid.add_point(surface.points().col(c));
        weight.values.push_back(surface.weight(c));
        cloth.values.push_back(panel.carries_cloth.empty() || panel.carries_cloth[static_cast<std::size_t>(c)]);
        place.values.insert(place.values.end(), {i, j});
        if (i > 0) line(surface.index(i - 1, j), c);
        if (j > 0) line(surface.index(i, j - 1), c);
      }
  }
  grid.point_reals.push_back(std::move(weight));
  grid.point_integers.push_back(std::move(cloth));
  grid.point_integers.push_back(std::move(place));
  grid.cell_integers.push_back(std::move(panel_number));
  return grid;
}

Grid trim_block(const Frame& frame) {
  Grid grid;
  Array<std::int32_t> loop_number{"loop", 1, {}}, curve_number{"curve", 1, {}}, hole{"hole", 1, {}},
      panel_number{"panel", 1, {}};
  for (std::size_t k = 0; k < frame.panels.size(); ++k) {
    const FramePanel& panel = frame.panels[k];
    for (const TrimLoop& loop : panel.face->loops)
      for (const TrimCurve& curve : loop.curves) {
        for (const Eigen::Vector3d& x : surface_polyline(*panel.surface, curve)) {
          grid.connectivity.push_back(grid.next_point());
          grid.add_point(x);
        }
        grid.close_cell(vtk_poly_line);
        loop_number.values.push_back(loop.index);
        curve_number.values.push_back(curve.index);
        hole.values.push_back(loop.kind == LoopKind::hole);
        panel_number.values.push_back(static_cast<std::int32_t>(k));
      }
  }
  grid.cell_integers = {std::move(loop_number), std::move(curve_number), std::move(hole), std::move(panel_number)};
  return grid;
}

Grid point_block(const Frame& frame) {
  Grid grid;
  Array<double> uv{"uv", 2, {}}, t{"t", 1, {}};
  Array<float> weft{"strain_weft", 1, {}}, warp{"strain_warp", 1, {}};
  Array<std::int32_t> kind{"kind", 1, {}}, used{"used", 1, {}}, loop{"loop", 1, {}}, curve{"curve", 1, {}},
      panel_number{"panel", 1, {}};
  std::array<Array<float>, 4> stress{{{"nominal_stress_weft", 1, {}},
                                      {"nominal_stress_warp", 1, {}},
                                      {"raw_nominal_stress_weft", 1, {}},
                                      {"raw_nominal_stress_warp", 1, {}}}};
  bool strained = true, stressed = true;
  for (const FramePanel& panel : frame.panels) {
    strained &= panel.point_strain.size() == panel.points.size();
    stressed &= panel.point_stress.size() == panel.points.size();
  }
  for (std::size_t k = 0; k < frame.panels.size(); ++k) {
    const FramePanel& panel = frame.panels[k];
    for (std::size_t i = 0; i < panel.points.size(); ++i) {
      const ConstraintPoint& point = panel.points[i];
      grid.connectivity.push_back(grid.next_point());
      grid.add_point((*panel.surface)(point.u, point.v));
      grid.close_cell(vtk_vertex);
      uv.values.insert(uv.values.end(), {point.u, point.v});
      t.values.push_back(point.t);
      kind.values.push_back(static_cast<std::int32_t>(point.kind));
      used.values.push_back(point.used);
      loop.values.push_back(point.loop);
      curve.values.push_back(point.curve);
      panel_number.values.push_back(static_cast<std::int32_t>(k));
      if (strained) {
        weft.values.push_back(static_cast<float>(panel.point_strain[i][0]));
        warp.values.push_back(static_cast<float>(panel.point_strain[i][1]));
      }
      for (int c = 0; stressed && c < 4; ++c)
        stress[static_cast<std::size_t>(c)].values.push_back(static_cast<float>(panel.point_stress[i][c]));
    }
  }
  if (strained) grid.point_fields = {std::move(weft), std::move(warp)};
  if (stressed) std::ranges::move(stress, std::back_inserter(grid.point_fields));
  grid.point_reals.push_back(std::move(uv));
  grid.point_reals.push_back(std::move(t));
  grid.point_integers = {std::move(kind), std::move(used), std::move(loop), std::move(curve), std::move(panel_number)};
  return grid;
}

std::string four_digits(int n) {
  const std::string digits = std::to_string(n);
  return std::string(digits.size() < 4 ? 4 - digits.size() : 0, '0') + digits;
}

}  // namespace

VtuBlocks format_vtu(const Frame& frame) {
  return {Writer().finish(surface_block(frame), frame.time), Writer().finish(triangle_block(frame), frame.time),
          Writer().finish(net_block(frame), frame.time), Writer().finish(trim_block(frame), frame.time),
          Writer().finish(point_block(frame), frame.time)};
}

namespace {

// Of frames that a resumed run has made before and that are here.
std::vector<PvdIndex::Entry> entries_of(const std::filesystem::path& folder, const std::string& name,
                                        const std::vector<double>& written, const char* ending) {
  std::vector<PvdIndex::Entry> out;
  for (std::size_t k = 0; k < written.size(); ++k) {
    const std::string file = name + '_' + four_digits(static_cast<int>(k)) + ending;
    if (std::filesystem::exists(folder / file)) out.push_back({written[k], file});
  }
  return out;
}

constexpr const char* cloth_ending = "/triangles.vtu";

}  // namespace

VtuSink::VtuSink(std::filesystem::path folder, std::string name, const std::vector<double>& written)
    : folder_(std::move(folder)),
      name_(std::move(name)),
      next_(static_cast<int>(written.size())),
      cloth_(folder_ / (name_ + ".pvd"), entries_of(folder_, name_, written, cloth_ending)),
      parts_(folder_ / (name_ + "_parts.pvd"), entries_of(folder_, name_, written, ".vtm")) {}

void VtuSink::write(const Frame& frame) {
  if (frame.number != next_)
    throw std::logic_error("VtuSink: frame " + std::to_string(frame.number) + " where " + std::to_string(next_) +
                           " was due");
  const std::string stem = name_ + '_' + four_digits(frame.number);
  const VtuBlocks blocks = format_vtu(frame);
  const std::array<std::pair<const char*, const std::string*>, 5> parts{{{"triangles", &blocks.triangles},
                                                                         {"surface", &blocks.surface},
                                                                         {"net", &blocks.net},
                                                                         {"trims", &blocks.trims},
                                                                         {"points", &blocks.points}}};
  // Parts first, the indices that name them last.
  std::string index =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"vtkMultiBlockDataSet\" version=\"1.0\" "
      "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<vtkMultiBlockDataSet>\n";
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const std::string part = parts[k].first;
    write_file(folder_ / stem / (part + ".vtu"), *parts[k].second, Flush::no);
    index += "<DataSet index=\"" + std::to_string(k) + "\" name=\"" + part + "\" file=\"" + xml_text(stem) + '/' +
             part + ".vtu\"/>\n";
  }
  write_file(folder_ / (stem + ".vtm"), index + "</vtkMultiBlockDataSet>\n</VTKFile>\n", Flush::no);
  parts_.append({frame.time, stem + ".vtm"});
  cloth_.append({frame.time, stem + cloth_ending});
  ++next_;
}

}  // namespace toile
