#include "core/geometry/rigid_shape.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/base/error.h"
#include "core/geometry/rigid_motion.h"
#include "core/math/elementary.h"
#include "core/math/sine.h"

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

// Each part turned and moved about the common center (Steiner).
MassProperties bulk_of_parts(const RigidShape& compound) {
  MassProperties whole;
  std::vector<MassProperties> parts;  // in the frame of the compound
  Vec3 moment;
  each_part(compound, [&](const RigidShape& part, const Vec3& at, const Mat3& axes) {
    const MassProperties own = mass_properties(part);
    parts.push_back({own.volume, at + axes * own.center, axes * own.covariance * transposed(axes)});
    whole.volume += own.volume;
    moment += own.volume * parts.back().center;
  });
  whole.center = moment / whole.volume;
  for (const MassProperties& part : parts) {
    const Vec3 off = part.center - whole.center;
    whole.covariance += part.covariance + part.volume * outer(off, off);
  }
  return whole;
}

// Inside test by the solid angles of the triangles (Van Oosterom & Strackee (1983), IEEE Trans.
// Biomed. Eng. 30, 125-126): their sum is 4 pi from inside, and 0 from outside.
bool is_inside(const RigidShape& mesh, const Vec3& p) {
  double half_angles = 0;
  for (const auto& t : mesh.triangles) {
    const Vec3 a = mesh.points[static_cast<std::size_t>(t[0])] - p;
    const Vec3 b = mesh.points[static_cast<std::size_t>(t[1])] - p;
    const Vec3 c = mesh.points[static_cast<std::size_t>(t[2])] - p;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    half_angles += elementary::atan2(a.dot(b.cross(c)),
                                     la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return half_angles > kPi;
}

RigidShape mesh_of_round(const RigidShape& part) {
  RigidShape mesh{.form = RigidShape::Form::kMesh};
  constexpr int kAround = 16, kRise = 4;  // to a right angle
  const auto turn = [](int steps) { return sine_cosine(steps / double{kAround}); };
  for (int ring = -kRise; ring <= kRise + 1; ++ring) {
    // The equator comes twice, at both ends of the axis.
    const auto [rise, out] = turn(ring > 0 ? ring - 1 : ring);
    const double end = (ring > 0 ? 0.5 : -0.5) * part.length;
    for (int i = 0; i < kAround; ++i) {
      const auto [s, c] = turn(i);
      mesh.points.push_back(part.radius *
                                Vec3(std::max(out, 0.0) * c, rise, std::max(out, 0.0) * s) +
                            Vec3(0, end, 0));
    }
  }
  for (int ring = 0; ring <= 2 * kRise; ++ring)
    for (int i = 0; i < kAround; ++i) {
      const int a = ring * kAround + i, b = ring * kAround + (i + 1) % kAround;
      mesh.triangles.push_back({a, a + kAround, b + kAround});
      mesh.triangles.push_back({a, b + kAround, b});
    }
  return mesh;
}

RigidShape mesh_of_box(const Vec3& half) {
  RigidShape mesh{.form = RigidShape::Form::kMesh};
  for (int k = 0; k < 8; ++k)
    mesh.points.push_back(
        {k & 1 ? half[0] : -half[0], k & 2 ? half[1] : -half[1], k & 4 ? half[2] : -half[2]});
  constexpr std::array<int, 4> kSides[] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                           {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& s : kSides) {
    mesh.triangles.push_back({s[0], s[1], s[2]});
    mesh.triangles.push_back({s[0], s[2], s[3]});
  }
  return mesh;
}

}  // namespace

const char* RigidShape::name() const {
  constexpr const char* kNames[] = {"sphere", "box", "capsule", "mesh", "compound"};
  return kNames[static_cast<int>(form)];
}

Mat3 turned_by(const Vec3& turn) {
  constexpr double kTurnsPerRadian = 0.15915494309189533577;
  Pose pose;
  if (const double angle = turn.norm(); angle > 0) {
    const auto [sine, cosine] = sine_cosine(angle * kTurnsPerRadian);
    pose.axis = turn / angle;
    pose.sine = sine;
    pose.cosine = cosine;
  }
  return transposed({pose.turned({1, 0, 0}), pose.turned({0, 1, 0}), pose.turned({0, 0, 1})});
}

RigidShape mesh_of(const RigidShape& part) {
  if (part.is_round()) return mesh_of_round(part);
  return part.form == RigidShape::Form::kBox ? mesh_of_box(part.half) : part;
}

// Triangles that lie within another part are not seen.
RigidShape make_compound(std::vector<RigidShape> parts) {
  RigidShape whole{.form = RigidShape::Form::kCompound};
  whole.parts = std::move(parts);
  std::vector<Mat3> axes;
  for (const RigidShape& part : whole.parts) axes.push_back(turned_by(part.rotation));
  // Meshes are left out: for each point they would be gone through whole.
  const auto is_hidden = [&](std::size_t of, const Vec3& x) {
    for (std::size_t k = 0; k < whole.parts.size(); ++k) {
      const RigidShape& part = whole.parts[k];
      if (k != of && part.form != RigidShape::Form::kMesh &&
          is_within(part, transposed(axes[k]) * (x - part.at)))
        return true;
    }
    return false;
  };
  for (std::size_t k = 0; k < whole.parts.size(); ++k) {
    const RigidShape& part = whole.parts[k];
    RigidShape mesh = mesh_of(part);
    std::vector<int> place(mesh.points.size(), -1);
    std::vector<bool> hidden;
    for (Vec3& point : mesh.points) {
      point = part.at + axes[k] * point;
      hidden.push_back(is_hidden(k, point));
    }
    for (std::array<int, 3> t : mesh.triangles) {
      if (std::ranges::all_of(t, [&](int i) { return hidden[static_cast<std::size_t>(i)]; }))
        continue;
      for (int& i : t) {
        int& known = place[static_cast<std::size_t>(i)];
        if (known < 0) {
          known = static_cast<int>(whole.points.size());
          whole.points.push_back(mesh.points[static_cast<std::size_t>(i)]);
        }
        i = known;
      }
      whole.triangles.push_back(t);
    }
  }
  return whole;
}

Vec3 in_part(const RigidShape& part, const Vec3& x) {
  return transposed(turned_by(part.rotation)) * (x - part.at);
}

bool is_within(const RigidShape& shape, const Vec3& x) {
  if (shape.form == RigidShape::Form::kCompound)
    return std::ranges::any_of(
        shape.parts, [&](const RigidShape& part) { return is_within(part, in_part(part, x)); });
  if (shape.form == RigidShape::Form::kMesh) {
    Vec3 low = x, high = x;
    for (const Vec3& point : shape.points) low = low.cwiseMin(point), high = high.cwiseMax(point);
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (low[axis] == x[axis] || high[axis] == x[axis]) return false;
    return is_inside(shape, x);
  }
  if (!shape.is_round()) return (x.cwiseAbs() - shape.half).maxCoeff() < 0;
  const double along = std::clamp(x.y(), -0.5 * shape.length, 0.5 * shape.length);
  return (x - Vec3(0, along, 0)).norm() < shape.radius;
}

double radius_about(const RigidShape& shape, const Vec3& center) {
  double radius = 0;
  switch (shape.form) {
    case RigidShape::Form::kSphere:
      return shape.radius + center.norm();
    case RigidShape::Form::kBox:
      return shape.half.norm() + center.norm();
    case RigidShape::Form::kCapsule:
      return shape.radius + 0.5 * shape.length + center.norm();
    case RigidShape::Form::kMesh:
      for (const Vec3& point : shape.points) radius = std::max(radius, (point - center).norm());
      return radius;
    case RigidShape::Form::kCompound:
      break;
  }
  each_part(shape, [&](const RigidShape& part, const Vec3& at, const Mat3& axes) {
    radius = std::max(radius, radius_about(part, transposed(axes) * (center - at)));
  });
  return radius;
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
    case RigidShape::Form::kCompound:
      return bulk_of_parts(shape);
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
