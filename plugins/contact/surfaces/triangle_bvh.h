// A bounding volume hierarchy (BVH) over the triangles of surfaces, and the pairs of elements whose
// boxes overlap.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "core/base/slot.h"
#include "core/base/thread_pool.h"
#include "core/geometry/triangle_mesh.h"
#include "core/particles/elements/torn_faces.h"
#include "time_of_impact.h"

namespace sim {

// Particles of a vertex and a triangle, or of two edges, in the order of separation_of().
struct SurfacePair {
  std::array<int, 4> ids;
  PairKind kind;
};

struct Aabb {
  Vec3 least, most;

  void add(const Aabb& other) {
    least = least.cwiseMin(other.least);
    most = most.cwiseMax(other.most);
  }
  bool meets(const Aabb& b) const {
    return least.x() <= b.most.x() && b.least.x() <= most.x() && least.y() <= b.most.y() &&
           b.least.y() <= most.y() && least.z() <= b.most.z() && b.least.z() <= most.z();
  }
};

// The elements of rigid bodies, which touch surfaces but not each other.
struct BodyElements {
  int first = 0;                   // the id of the first vertex: the number of particles
  std::vector<double> radii = {};  // m, around each vertex
  // A triangle with a corner twice is none: only its vertices and edges touch.
  std::vector<TriangleMesh::Triangle> triangles = {};
  std::vector<int> body_of = {};            // of each triangle
  std::set<std::pair<int, int>> tied = {};  // a body and a particle that do not touch

  double radius(int id) const { return id < first ? 0.0 : radii[slot(id - first)]; }
  bool are_tied(int body, std::span<const int> ids) const;  // the body and one of these
};

// A tree of axis-aligned boxes over all triangles, built once for the initial positions and
// refitted afterwards. Every vertex and edge belongs to one of its triangles, so that no pair is
// found twice (Curtis, Tamstorf & Manocha 2008). The order of pairs is that of the tree: neither
// pairs that are too far apart to be listed nor threads change it.
class TriangleBvh {
 public:
  // self: pairs within one surface count, too. start: of all particles, then of vertices of bodies.
  TriangleBvh(std::span<const std::shared_ptr<const TriangleMesh>> surfaces, bool self,
              std::span<const Vec3> start, BodyElements bodies = {});

  std::span<const int> vertices() const { return vertices_; }  // ascending
  std::span<const int> particles() const { return std::span(vertices_).first(particles_); }
  std::span<const std::array<int, 2>> edges() const { return edges_; }
  std::span<const TriangleMesh::Triangle> triangles() const { return triangles_; }

  // Removes faces with such an edge from all pairs, and edges that are torn or left without a face.
  // Replaces what was said before.
  void tear(std::span<const std::array<int, 2>> torn);
  bool triangle_gone(std::size_t t) const { return !gone_.triangles.empty() && gone_.triangles[t]; }
  bool edge_gone(std::size_t edge) const { return !gone_.edges.empty() && gone_.edges[edge]; }

  // The radius, m, around a vertex, and around the points of one part of a pair.
  double radius(int id) const { return bodies_.radii.empty() ? 0 : bodies_.radius(id); }
  double radius(const SurfacePair& pair) const {
    return std::max(radius(pair.ids[0]), radius(pair.ids[2]));
  }

  // All pairs whose boxes overlap, those of a vertex and a triangle first; boxes: of the particles.
  // Memory is kept in `pairs`.
  void find_pairs(std::span<const Aabb> boxes, ThreadPool& pool, std::vector<SurfacePair>& pairs);

 private:
  struct Node {
    Aabb box;
    int first, count;  // of order_; count 0: an inner node, whose children are the next and...
    int second;        // ...this one
  };
  struct Owned {  // by a triangle: vertices and edges, -1 for none
    std::array<int, 3> vertices{-1, -1, -1}, edges{-1, -1, -1};
  };
  struct Task {
    int a, b;
    std::vector<SurfacePair> found;
  };

  int build(int begin, int end, std::span<const Vec3> middles);
  void refit(std::span<const Aabb> boxes);
  void split_tasks(int a, int b, int depth);
  void walk(int a, int b, std::span<const Aabb> boxes, std::vector<SurfacePair>& found) const;
  void leaves(const Node& a, const Node& b, std::span<const Aabb> boxes,
              std::vector<SurfacePair>& found) const;
  void triangle_pairs(int a, int b, std::span<const Aabb> boxes,
                      std::vector<SurfacePair>& found) const;

  void own(TriangleMesh::Triangle t, int surface, std::vector<std::uint8_t>& has_owner);
  bool touch(int a, int b) const;  // whether these triangles may

  bool self_;
  BodyElements bodies_;
  std::size_t particles_ = 0;  // of the vertices
  std::vector<TriangleMesh::Triangle> triangles_;
  std::vector<int> surface_of_;  // of each triangle; -1 - its number: a body
  std::vector<std::array<int, 2>> edges_;
  std::vector<int> vertices_;
  std::vector<Owned> owned_;
  std::vector<int> order_;  // of triangles, leaf by leaf
  std::vector<Node> nodes_;
  std::vector<Aabb> triangle_boxes_;
  std::vector<Task> tasks_;
  TornParts gone_;
};

}  // namespace sim
