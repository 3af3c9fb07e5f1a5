// The shape of a rigid body, and its mass properties.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "core/math/mat3.h"

namespace sim {

// A shape about the origin of its own frame; the axis of a capsule is y.
struct RigidShape {
  enum class Form { kSphere, kBox, kCapsule, kMesh, kCompound };

  Form form = Form::kSphere;
  Vec3 half{0, 0, 0};  // m, of the edges of a box
  double radius = 0;   // m, of a sphere and a capsule
  double length = 0;   // m, of the straight part of a capsule
  // The points of a mesh, m, and its triangles, counter-clockwise as seen from outside; a compound
  // has those of its surface as it is drawn.
  std::vector<Vec3> points = {};
  std::vector<std::array<int, 3>> triangles = {};
  // A compound has parts, each with its pose: m, and rad about this axis by its length.
  std::vector<RigidShape> parts = {};
  Vec3 at{0, 0, 0}, rotation{0, 0, 0};

  bool is_round() const { return form == Form::kSphere || form == Form::kCapsule; }
  const char* name() const;
};

// The axes rotated by |turn| rad about `turn`.
Mat3 turned_by(const Vec3& turn);

// The surface of a shape that is no compound, as a mesh: twelve triangles of a box, rings around
// the axis of what is round, from pole to pole in steps of 22.5 degrees.
RigidShape mesh_of(const RigidShape& part);

// A shape of parts that keep their places to each other; none of them is a compound itself.
RigidShape make_compound(std::vector<RigidShape> parts);

// Calls take(shape, its center, its axes) of each part in the frame of a compound, or of the shape
// itself.
template <class Take>
void each_part(const RigidShape& shape, const Take& take) {
  if (shape.form != RigidShape::Form::kCompound) return take(shape, Vec3(), Mat3::Identity());
  for (const RigidShape& part : shape.parts) take(part, part.at, turned_by(part.rotation));
}

// A point of a compound, m, in the frame of one of its parts.
Vec3 in_part(const RigidShape& part, const Vec3& x);
bool is_within(const RigidShape& shape, const Vec3& x);
// The radius, m, of a ball about `center` that holds the shape, in the frame of the shape.
double radius_about(const RigidShape& shape, const Vec3& center);

// The mass properties of a body of density 1 kg/m^3.
struct MassProperties {
  double volume = 0;     // m^3
  Vec3 center{0, 0, 0};  // m
  Mat3 covariance;       // m^5, the integral of r r^T about the center
};

// Closed forms; for a mesh exact, over the cones from one point to its triangles; where parts of a
// compound overlap each counts. Throws Error{kScene} for a mesh that is not closed, inside out or
// without volume.
MassProperties mass_properties(const RigidShape& shape);

struct PrincipalAxes {
  Vec3 values;   // of the matrix
  Mat3 columns;  // of length 1, right-handed
};

// The principal axes of a symmetric matrix, by Jacobi's rotations; those of a diagonal one are the
// coordinate axes.
PrincipalAxes principal_axes(Mat3 matrix);

}  // namespace sim
