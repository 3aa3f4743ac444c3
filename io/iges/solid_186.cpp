// SPDX-License-Identifier: GPL-3.0-or-later
// Entities 186 (manifold solid), 514 (shell), 510 (face), 508 (loop), 504 (edge list), 502 (vertex list).
// [IGES 5.3, 4.48, 4.147 to 4.151]
#include "io/iges/topology.h"

namespace toile::iges {

namespace {

int read_count(Parameters& in, const char* of, int least, long long each) {
  const int n = in.integer("N");
  if (n < least) in.fail("N is " + std::to_string(n) + ", must be " + std::to_string(least) + " or more");
  in.expect(each * n, std::to_string(n) + " " + of);
  return n;
}

std::vector<Use> read_uses(Parameters& in, int n, const char* what) {
  std::vector<Use> uses;
  for (int i = 0; i < n; ++i) {
    const int sequence = in.pointer(what);
    uses.push_back({sequence, in.integer("orientation", 1) != 0});
  }
  return uses;
}

void write_uses(const std::vector<Use>& uses, Record& out) {
  for (const Use& use : uses) out.integer(use.sequence).integer(use.forward ? 1 : 0);
}

}  // namespace

Solid read_solid(Parameters& in) {
  Solid solid;
  solid.shells = read_uses(in, 1, "SHELL");
  const int n = in.left() > 0 ? read_count(in, "void shells", 0, 2) : 0;
  for (const Use& use : read_uses(in, n, "VOID")) solid.shells.push_back(use);
  return solid;
}

void write(const Solid& solid, Record& out) {
  write_uses({solid.shells.front()}, out);
  out.integer(static_cast<long long>(solid.shells.size()) - 1);
  write_uses({solid.shells.begin() + 1, solid.shells.end()}, out);
}

Shell read_shell(Parameters& in) {
  const int n = read_count(in, "faces", 1, 2);
  return {read_uses(in, n, "FACE")};
}

void write(const Shell& shell, Record& out) {
  out.integer(static_cast<long long>(shell.faces.size()));
  write_uses(shell.faces, out);
}

TopologicalFace read_topological_face(Parameters& in) {
  TopologicalFace face;
  face.surface = in.pointer("SURF");
  const int n = in.integer("N");
  if (n < 1) in.fail("N is " + std::to_string(n) + ", must be positive");
  face.outer_first = in.integer("OF") != 0;
  in.expect(n, std::to_string(n) + " loops");
  for (int i = 0; i < n; ++i) face.loops.push_back(in.pointer("LOOP"));
  return face;
}

void write(const TopologicalFace& face, Record& out) {
  out.integer(face.surface).integer(static_cast<long long>(face.loops.size())).integer(face.outer_first ? 1 : 0);
  for (const int loop : face.loops) out.integer(loop);
}

EdgeLoop read_edge_loop(Parameters& in) {
  const int n = read_count(in, "edges", 1, 5);
  EdgeLoop loop;
  for (int i = 0; i < n; ++i) {
    EdgeUse use;
    use.vertex = in.integer("TYPE") == 1;
    use.list = in.pointer("EDGE");
    use.index = in.integer("NDX");
    use.forward = in.integer("OF", 1) != 0;
    const int k = in.integer("K");
    if (k < 0) in.fail("K is " + std::to_string(k) + ", must not be negative");
    in.expect(2LL * k, std::to_string(k) + " parameter curves");
    for (int j = 0; j < k; ++j) {
      const int iso = in.integer("ISOP");
      use.curves.push_back({iso, in.pointer("CURV")});
    }
    loop.edges.push_back(std::move(use));
  }
  return loop;
}

void write(const EdgeLoop& loop, Record& out) {
  out.integer(static_cast<long long>(loop.edges.size()));
  for (const EdgeUse& use : loop.edges) {
    out.integer(use.vertex ? 1 : 0).integer(use.list).integer(use.index).integer(use.forward ? 1 : 0);
    out.integer(static_cast<long long>(use.curves.size()));
    for (const auto& curve : use.curves) out.integer(curve.iso).integer(curve.curve);
  }
}

EdgeList read_edge_list(Parameters& in) {
  const int n = read_count(in, "edges", 1, 5);
  EdgeList list;
  for (int i = 0; i < n; ++i) {
    Edge edge;
    edge.curve = in.pointer("CURV");
    for (int& vertex : edge.vertices) vertex = in.integer("vertex of an edge");
    list.edges.push_back(edge);
  }
  return list;
}

void write(const EdgeList& list, Record& out) {
  out.integer(static_cast<long long>(list.edges.size()));
  for (const Edge& edge : list.edges) {
    out.integer(edge.curve);
    for (const int vertex : edge.vertices) out.integer(vertex);
  }
}

VertexList read_vertex_list(Parameters& in) {
  const int n = read_count(in, "vertices", 1, 3);
  VertexList list;
  for (int i = 0; i < n; ++i) {
    Eigen::Vector3d x;
    for (int axis = 0; axis < 3; ++axis) x[axis] = in.real("coordinate of vertex", i);
    list.points.push_back(x);
  }
  return list;
}

void write(const VertexList& list, Record& out) {
  out.integer(static_cast<long long>(list.points.size()));
  for (const Eigen::Vector3d& x : list.points)
    for (int axis = 0; axis < 3; ++axis) out.real(x[axis]);
}

}  // namespace toile::iges
