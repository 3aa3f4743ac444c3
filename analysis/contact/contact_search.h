// SPDX-License-Identifier: GPL-3.0-or-later
// Which contacts may be at work in a step.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "analysis/contact/bounds_tree.h"
#include "analysis/contact/contact_proxy.h"
#include "analysis/contact/contact_row.h"
#include "analysis/contact/obstacle.h"
#include "analysis/contact/self_search.h"

namespace toile {

// Of ContactRow::key: the cloth's vertices, edges and triangles with faces, sharp edges and vertices of an obstacle;
// its vertices and edges with its own triangles and edges.
enum ContactKind { vertex_to_face, edge_to_edge, face_to_vertex, vertex_to_cloth, edge_to_cloth };

struct ContactSearchOptions {
  double largest_chord = 1e-3;              // m, of the chord error that is added to the offset
  bool self = false;                        // the cloth meets itself
  Eigen::MatrixXd friction = {};            // panels x obstacles; empty: the obstacles' own
  Eigen::MatrixXd friction_of_panels = {};  // panels x panels; empty: the mean of two panels' own
  std::vector<SewnChart> charts = {};       // around seams
};

// The places of a step: of fixed control points and of the proxy's vertices, at its start and in its candidate.
struct StepPlaces {
  double dt = 0;  // s
  Eigen::Matrix3Xd fixed_before, fixed_now, from, at;
};

// Nodes, their weights and what fixed control points add, of a row from its vertices.
void set_nodes(const ContactProxy& proxy, const StepPlaces& places, ContactRow& row);

// The nearest point of an obstacle, seen from the side that the cloth is on.
struct Meeting : SurfacePoint {
  int side = 1;  // -1: the inner one, of a surface that is met from either side
};
// `side` 0: the side of p, of an obstacle that has two; else the outside.
std::optional<Meeting> nearest_from_side(const Obstacle& obstacle, const Eigen::Vector3d& p, double reach, int side);

//   (1) found is every vertex that comes within its offset of an obstacle or passes through, however thin that is, and
//       what of the cloth's edges and triangles comes near a sharp edge or vertex that it was outside of;
//   (2) the side is that of the start of the step;
//   (3) a vertex that moved no farther than was free around it is not looked at again; rows don't depend on that, nor
//   on
//       threads; they ascend by key.
class ContactSearch {
 public:
  // Obstacles and the proxy must outlive it.
  ContactSearch(const ContactProxy& proxy, const Body& body, std::vector<Obstacle*> obstacles,
                const ContactSearchOptions& options);
  // Rows without forces, compliance and bias.
  std::vector<ContactRow> find(const StepPlaces& places, Workers* workers);

 private:
  struct Sharp {  // of an obstacle
    BoundsTree edges, vertices;
  };
  void look(int vertex, int obstacle, std::vector<ContactRow>& out);
  void look_at_edges(int obstacle, std::vector<ContactRow>& out) const;
  void look_at_vertices(int obstacle, std::vector<ContactRow>& out) const;
  void look_at_cloth(std::vector<ContactRow>& out);
  void add_sharp(ContactRow row, const Eigen::Vector3d& normal, const Eigen::Vector3d& target,
                 std::vector<ContactRow>& out) const;
  void add_bulges(std::vector<ContactRow>& rows);
  bool far(int obstacle, int vertex, double distance) const;
  double friction(int panel, int obstacle) const;
  double friction_between(int panel, int other) const;

  const ContactProxy& proxy_;
  std::vector<Obstacle*> obstacles_;
  ContactSearchOptions options_;
  const StepPlaces* places_ = nullptr;          // of the present find()
  std::vector<std::vector<ContactRow>> found_;  // per piece of vertices
  std::vector<int> row_at_;                     // per obstacle and vertex, -1: none
  // Per obstacle and vertex: where it was looked at, and how far from there nothing is near.
  std::vector<Eigen::Matrix3Xd> looked_at_;
  std::vector<Eigen::VectorXd> clear_;
  std::vector<Sharp> sharp_;
  std::optional<SelfSearch> self_;
};

}  // namespace toile
