#include "core/geometry/rigid_shape.h"

#include <cmath>
#include <map>

#include "core/base/error.h"

namespace sim {
namespace {

constexpr double kPi = 3.14159265358979323846;

[[noreturn]] void refuse_mesh(const std::string& why, const std::string& remedy) {
  throw Error(ErrorKind::kScene, {"mesh of a rigid body", "", why, remedy});
}

// A closed surface has each edge once in each direction.
void check_closed(const RigidShape& mesh) {
  const auto count = static_cast<int>(mesh.points.size());
  std::map<std::array<int, 2>, int> edges;
  for (const auto& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      if (a < 0 || a >= count || a == b)
        refuse_mesh("a triangle names point " + std::to_string(a) + " of " + std::to_string(count),
                    "number points from 0, three different ones a triangle");
      ++edges[{a, b}];
    }
  for (const auto& [edge, times] : edges) {
    const auto back = edges.find({edge[1], edge[0]});
    if (times == 1 && back != edges.end()) continue;
    refuse_mesh("it is not closed at the edge from point " + std::to_string(edge[0]) + " to " +
                    std::to_string(edge[1]),
                "give each edge two triangles, both counter-clockwise from outside");
  }
}

// A cell 0, a, b, c of density 1 has mass det / 6, center s / 4 with s = a + b + c, and
// second moment det / 120 (s s^T + a a^T + b b^T + c c^T) about 0.
MassProperties bulk_of_mesh(const RigidShape& mesh) {
  check_closed(mesh);
  const Vec3 origin = mesh.points.empty() ? Vec3() : mesh.points.front();
  MassProperties bulk;
  Vec3 moment;
  double size = 0;
  for (const auto& t : mesh.triangles) {
    const auto corner = [&](std::size_t k) {
      return mesh.points[static_cast<std::size_t>(t[k])] - origin;
    };
    const Vec3 a = corner(0), b = corner(1), c = corner(2), s = a + b + c;
    const double det = a.dot(b.cross(c));
    bulk.volume += det / 6;
    moment += det / 24 * s;
    bulk.covariance += det / 120 * (outer(s, s) + outer(a, a) + outer(b, b) + outer(c, c));
    size = std::max(size, s.norm());
  }
  if (!(bulk.volume > 1e-12 * size * size * size))
    refuse_mesh("its volume is " + std::to_string(bulk.volume) + " m^3",
                "give triangles counter-clockwise as seen from outside");
  const Vec3 center = moment / bulk.volume;
  bulk.covariance -= bulk.volume * outer(center, center);
  bulk.center = origin + center;
  return bulk;
}

}  // namespace

const char* RigidShape::name() const {
  constexpr const char* kNames[] = {"sphere", "box", "capsule", "mesh"};
  return kNames[static_cast<int>(form)];
}

MassProperties mass_properties(const RigidShape& shape) {
  const double r = shape.radius, l = shape.length;
  switch (shape.form) {
    case RigidShape::Form::kSphere: {
      const double volume = 4 * kPi / 3 * r * r * r, each = volume * r * r / 5;
      return {volume, {}, Mat3::Diagonal({each, each, each})};
    }
    case RigidShape::Form::kBox: {
      const Vec3& h = shape.half;
      const double volume = 8 * h[0] * h[1] * h[2];
      return {volume, {}, Mat3::Diagonal(volume / 3 * Vec3(h[0] * h[0], h[1] * h[1], h[2] * h[2]))};
    }
    case RigidShape::Form::kCapsule: {
      // A cylinder and two half balls, whose centers of mass are 3 r / 8 beyond its ends.
      const double tube = kPi * r * r * l, ball = 4 * kPi / 3 * r * r * r;
      const double across = tube * r * r / 4 + ball * r * r / 5;
      const double along = tube * l * l / 12 + ball * (r * r / 5 + 3 * r * l / 8 + l * l / 4);
      return {tube + ball, {}, Mat3::Diagonal({across, along, across})};
    }
    case RigidShape::Form::kMesh:
      break;
  }
  return bulk_of_mesh(shape);
}

PrincipalAxes principal_axes(Mat3 a) {
  constexpr int kMostSweeps = 50;
  Mat3 v = Mat3::Identity();
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    bool done = true;
    for (std::size_t p = 0; p < 2; ++p)
      for (std::size_t q = p + 1; q < 3; ++q) {
        if (std::fabs(a(p, q)) <= 1e-17 * (std::fabs(a(p, p)) + std::fabs(a(q, q)))) continue;
        done = false;
        // The rotation by the smaller angle that makes a_pq zero (Jacobi).
        const double theta = (a(q, q) - a(p, p)) / (2 * a(p, q));
        const double t =
            std::copysign(1.0, theta) / (std::fabs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        Mat3 turn = Mat3::Identity();
        turn(p, p) = turn(q, q) = c;
        turn(p, q) = s;
        turn(q, p) = -s;
        a = transposed(turn) * a * turn;
        v = v * turn;
      }
    if (done) break;
  }
  if (v.column(0).cross(v.column(1)).dot(v.column(2)) < 0)
    for (std::size_t row = 0; row < 3; ++row) v(row, 2) = -v(row, 2);
  return {{a(0, 0), a(1, 1), a(2, 2)}, v};
}

}  // namespace sim
