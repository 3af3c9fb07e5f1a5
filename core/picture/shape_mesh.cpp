// Solids of a picture: balls, boxes and capsules of triangles, planes as a large square.
#include <algorithm>
#include <map>

#include "core/geometry/rigid_shape.h"
#include "core/picture/scenery.h"

namespace sim {
namespace {

class MeshMaker {
 public:
  MeshMaker(Picture& picture, const Viewpoint& viewpoint, const Vec3& offset, int skin)
      : picture_(picture), viewpoint_(viewpoint), offset_(offset), skin_(skin) {}

  int point(const Vec3& x, const Vec3& normal) {
    picture_.points.push_back(viewpoint_.point(x + offset_));
    picture_.normals.push_back({static_cast<float>(normal.x()), static_cast<float>(normal.y()),
                                static_cast<float>(normal.z())});
    if (!picture_.colours.empty()) picture_.colours.push_back(picture_.skins[skin()].front);
    return static_cast<int>(picture_.points.size()) - 1;
  }
  void triangle(int a, int b, int c) {
    picture_.triangles.push_back({{a, b, c}, skin_, true, true});
  }
  void quad(int a, int b, int c, int d, bool casts = true) {
    picture_.triangles.push_back({{a, b, c}, skin_, true, casts});
    picture_.triangles.push_back({{a, c, d}, skin_, true, casts});
  }

 private:
  std::size_t skin() const { return static_cast<std::size_t>(skin_); }

  Picture& picture_;
  const Viewpoint& viewpoint_;
  const Vec3& offset_;
  int skin_;
};

void add_box(MeshMaker& mesh, const RenderShape& box) {
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0}) {
      const auto& e = box.axes;
      const auto i = static_cast<std::size_t>(axis);
      const Vec3 out = side * e[i], u = e[(i + 1) % 3], v = side * e[(i + 2) % 3];
      const Vec3 middle = box.center + out, normal = out / out.norm();
      mesh.quad(mesh.point(middle - u - v, normal), mesh.point(middle + u - v, normal),
                mesh.point(middle + u + v, normal), mesh.point(middle - u + v, normal));
    }
}

// Rings around the axis, from pole to pole. The circle is 32 points turned on by one angle, of
// which sine and cosine are halved from those of a right angle.
void add_capsule(MeshMaker& mesh, const RenderShape& capsule) {
  constexpr int kAround = 32, kRings = 8;  // rings of each half ball
  double cosine = 0, sine = 1;             // of 90 degrees, then 45, 22.5, 11.25
  for (int halves = 0; halves < 3; ++halves) {
    const double c = std::sqrt(0.5 * (1 + cosine)), s = std::sqrt(0.5 * (1 - cosine));
    cosine = c, sine = s;
  }
  const Vec3 half = capsule.axes[0];
  const double length = half.norm();
  const Vec3 axis = length > 0 ? Vec3(half / length) : Vec3(0, 1, 0);
  const RenderShape frame = plane_shape(capsule.center, axis);
  const Vec3 u = frame.axes[0], v = frame.axes[2];
  std::vector<std::array<double, 2>> circle{{1, 0}};
  for (int i = 1; i < kAround; ++i) {
    const auto [c, s] = circle.back();
    circle.push_back({c * cosine - s * sine, s * cosine + c * sine});
  }
  std::vector<int> before;
  for (int ring = 0; ring <= 2 * kRings + 1; ++ring) {
    const bool top = ring > kRings;
    const int step = top ? ring - kRings - 1 : kRings - ring;  // 0: the equator
    // 8 steps to a right angle are the same 11.25 degrees.
    const double out = circle[static_cast<std::size_t>(step)][0],
                 rise = circle[static_cast<std::size_t>(step)][1] * (top ? 1 : -1);
    std::vector<int> now;
    for (const auto& [c, s] : circle) {
      const Vec3 normal = rise * axis + std::max(out, 0.0) * (c * u + s * v);
      const Vec3 end = top ? Vec3(capsule.center + half) : Vec3(capsule.center - half);
      now.push_back(mesh.point(end + capsule.radius * normal, normal));
    }
    for (std::size_t i = 0; i < before.size(); ++i) {
      const std::size_t j = (i + 1) % before.size();
      mesh.quad(before[i], now[i], now[j], before[j]);
    }
    before = now;
  }
}

// Flat faces.
void add_triangles(MeshMaker& mesh, const RenderShape& solid) {
  const auto place = [&](int i) {
    const Vec3& p = solid.mesh->points[static_cast<std::size_t>(i)];
    return solid.center + p[0] * solid.axes[0] + p[1] * solid.axes[1] + p[2] * solid.axes[2];
  };
  for (const auto& t : solid.mesh->triangles) {
    const Vec3 a = place(t[0]), b = place(t[1]), c = place(t[2]);
    const Vec3 normal = (b - a).cross(c - a).normalized();
    mesh.triangle(mesh.point(a, normal), mesh.point(b, normal), mesh.point(c, normal));
  }
}

// The lines along the edges of a box or a mesh: without them stones of a wall are one.
class Outline {
 public:
  Outline(Picture& picture, const RenderShape& solid, const Viewpoint& viewpoint,
          const Vec3& offset)
      : picture_(picture), solid_(solid), viewpoint_(viewpoint), offset_(offset) {}

  void box() const {
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const double v : {-1.0, 1.0})
        for (const double w : {-1.0, 1.0}) {
          Vec3 end(0, 0, 0);
          end[(axis + 1) % 3] = v, end[(axis + 2) % 3] = w;
          Vec3 other = end;
          end[axis] = -1, other[axis] = 1;
          line(end, other);
        }
  }
  void mesh() const {
    for (const auto& [a, b] : sharp_edges(*solid_.mesh))
      line(solid_.mesh->points[static_cast<std::size_t>(a)],
           solid_.mesh->points[static_cast<std::size_t>(b)]);
  }

 private:
  V3 place(const Vec3& p) const {
    return viewpoint_.point(solid_.center + p[0] * solid_.axes[0] + p[1] * solid_.axes[1] +
                            p[2] * solid_.axes[2] + offset_);
  }
  void line(const Vec3& a, const Vec3& b) const {
    const unsigned rgb = solid_.inside ? 0x6B7078 : solid_.body ? 0x7A4F24 : 0x4B5868;
    picture_.lines.push_back({place(a), place(b), 1, colour(rgb), !solid_.inside});
  }

  Picture& picture_;
  const RenderShape& solid_;
  const Viewpoint& viewpoint_;
  const Vec3& offset_;
};

}  // namespace

std::vector<std::array<int, 2>> sharp_edges(const RigidShape& mesh) {
  constexpr double kSharp = 0.766;          // cosine of 40 degrees
  std::map<std::array<int, 2>, Vec3> open;  // with the normal of the one face so far
  std::vector<std::array<int, 2>> sharp;
  const auto at = [&](int i) { return mesh.points[static_cast<std::size_t>(i)]; };
  for (const auto& t : mesh.triangles) {
    const Vec3 normal = (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).normalized();
    for (std::size_t k = 0; k < 3; ++k) {
      const std::array<int, 2> edge{std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3])};
      const auto [other, first] = open.try_emplace(edge, normal);
      if (first) continue;
      if (other->second.dot(normal) < kSharp) sharp.push_back(edge);
      open.erase(other);
    }
  }
  // Where parts of a compound enter another they are open.
  if (mesh.form != RigidShape::Form::kCompound)
    for (const auto& [edge, normal] : open) sharp.push_back(edge);
  return sharp;
}

void add_solid(Picture& picture, const RenderShape& solid, const Viewpoint& viewpoint,
               const Vec3& offset, int skin) {
  MeshMaker mesh(picture, viewpoint, offset, skin);
  const Outline outline(picture, solid, viewpoint, offset);
  const auto whole = [](const Vec3& p) { return p.allFinite(); };
  if (!whole(solid.center) || !std::ranges::all_of(solid.axes, whole)) return;
  if (solid.inside) {
    if (solid.form == RenderShape::Form::kBox) outline.box();
    return;
  }
  switch (solid.form) {
    case RenderShape::Form::kNone:
      return;
    case RenderShape::Form::kSphere: {
      const auto radius = static_cast<float>(solid.radius * viewpoint.scale);
      picture.balls.push_back({viewpoint.point(solid.center + offset), radius,
                               picture.skins[static_cast<std::size_t>(skin)].front, true});
      return;
    }
    case RenderShape::Form::kPlane: {
      // The one that is the ground is there already.
      if (solid.axes[1].dot(viewpoint.up) > 0.999999) return;
      // The foot of the perpendicular from the middle of the picture.
      const Vec3 from_middle = viewpoint.origin - solid.center - offset;
      const Vec3 middle =
          viewpoint.origin - from_middle.dot(solid.axes[1]) * solid.axes[1] - offset;
      const double size = 1.1 / viewpoint.scale;
      const Vec3 u = size * solid.axes[0], v = -size * solid.axes[2];
      mesh.quad(mesh.point(middle - u - v, solid.axes[1]),
                mesh.point(middle + u - v, solid.axes[1]),
                mesh.point(middle + u + v, solid.axes[1]),
                mesh.point(middle - u + v, solid.axes[1]), false);
      return;
    }
    case RenderShape::Form::kBox:
      add_box(mesh, solid);
      return outline.box();
    case RenderShape::Form::kCapsule:
      return add_capsule(mesh, solid);
    case RenderShape::Form::kMesh:
      if (!solid.mesh) return;
      add_triangles(mesh, solid);
      return outline.mesh();
  }
}

}  // namespace sim
