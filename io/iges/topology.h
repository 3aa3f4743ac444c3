// SPDX-License-Identifier: GPL-3.0-or-later
// What bounds faces and what groups them: records of pointers.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <string>
#include <vector>

#include "io/iges/parameters.h"

namespace toile::iges {

// 141: model curves with their parameter curves.
struct BoundaryUse {
  int model = 0;
  int sense = 1;  // 2: the model curve is run backwards
  std::vector<int> parameter_curves;
};
struct BoundaryList {
  int kind = 0;        // 0: model curves only, 1: parameter curves too
  int preference = 0;  // 1 model curves, 2 parameter curves, 3 either (142 counts the other way round)
  int surface = 0;
  std::vector<BoundaryUse> curves;
};
BoundaryList read_boundary_list(Parameters& in);
void write(const BoundaryList& boundary, Record& out);

// 143: a surface and its boundaries (141), in any order.
struct BoundedSurface {
  int kind = 0, surface = 0;
  std::vector<int> boundaries;
};
BoundedSurface read_bounded_surface(Parameters& in);
void write(const BoundedSurface& face, Record& out);

// 186: shells with the direction of their faces; the first is the outer one.
// 514: faces (510), alike. 510: a surface and its loops (508), the first the outer one where `outer_first`.
struct Use {
  int sequence = 0;
  bool forward = true;
};
struct Solid {
  std::vector<Use> shells;
};
Solid read_solid(Parameters& in);
void write(const Solid& solid, Record& out);
struct Shell {
  std::vector<Use> faces;
};
Shell read_shell(Parameters& in);
void write(const Shell& shell, Record& out);
struct TopologicalFace {
  int surface = 0;
  bool outer_first = true;
  std::vector<int> loops;
};
TopologicalFace read_topological_face(Parameters& in);
void write(const TopologicalFace& face, Record& out);

// 508: edges (of a list 504) and vertices (of a list 502), each with its parameter curves.
struct EdgeUse {
  bool vertex = false;
  int list = 0, index = 1;
  bool forward = true;
  struct ParameterCurve {
    int iso = 0, curve = 0;
  };
  std::vector<ParameterCurve> curves;
};
struct EdgeLoop {
  std::vector<EdgeUse> edges;
};
EdgeLoop read_edge_loop(Parameters& in);
void write(const EdgeLoop& loop, Record& out);

// 504: model curves between vertices.
struct Edge {
  int curve = 0;
  std::array<int, 4> vertices{};  // list and index of the start, of the end
};
struct EdgeList {
  std::vector<Edge> edges;
};
EdgeList read_edge_list(Parameters& in);
void write(const EdgeList& list, Record& out);

// 502
struct VertexList {
  std::vector<Eigen::Vector3d> points;
};
VertexList read_vertex_list(Parameters& in);
void write(const VertexList& list, Record& out);

// 116 (point, with a display symbol) and 123 (direction).
struct PlacePoint {
  Eigen::Vector3d x{0, 0, 0};
  int symbol = 0;
};
PlacePoint read_point(Parameters& in);
void write(const PlacePoint& point, Record& out);
Eigen::Vector3d read_direction(Parameters& in);
void write_direction(const Eigen::Vector3d& direction, Record& out);

// 308: a definition; 408: an instance of it, x -> scale x + translation.
struct Definition {
  int depth = 0;
  std::string name;
  std::vector<int> members;
};
Definition read_definition(Parameters& in);
void write(const Definition& definition, Record& out);
struct Instance {
  int definition = 0;
  Eigen::Vector3d translation{0, 0, 0};
  double scale = 1;
};
Instance read_instance(Parameters& in);
void write(const Instance& instance, Record& out);
Eigen::Affine3d placement(const Instance& instance);

// 402 forms 1, 7, 14 and 15: the members of a group; form 9: a parent, then its children.
std::vector<int> read_group(Parameters& in);
void write_group(const std::vector<int>& members, int form, Record& out);

}  // namespace toile::iges
