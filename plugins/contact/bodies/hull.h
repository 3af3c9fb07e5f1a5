// A convex hull with flat faces, the collision shape of boxes and meshes.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "core/particles/rigid/rigid_body.h"

namespace sim {

// Coordinates are in the frame of the shape, m.
struct Hull {
  static constexpr std::size_t kMostCorners = 32;  // of a face

  struct Face {
    Vec3 normal;             // outward, of length 1
    double level = 0;        // normal.x of its points
    int begin = 0, end = 0;  // of corners: its points, counter-clockwise from outside
  };
  struct Edge {
    int a = 0, b = 0;  // its points
    Vec3 left, right;  // the normals of its two faces
  };

  std::vector<Vec3> points;
  std::vector<int> corners;
  std::vector<Face> faces;
  std::vector<Edge> edges;
  std::vector<std::array<int, 3>> triangles;  // of all faces
  Vec3 middle{0, 0, 0};                       // inside

  Vec3 farthest(const Vec3& direction) const;
};

// The hull of a box or a closed mesh; coplanar triangles are one face. Empty for other shapes, for
// a mesh that is not convex to 1e-6 of its size, and for faces with too many corners.
std::optional<Hull> hull_of(const RigidShape& shape);

}  // namespace sim
