// Solids as triangles: their points lie on them, with the normals there, and enclose their volume.
#include <catch2/catch.hpp>
#include <map>

#include "core/geometry/rigid_shape.h"
#include "core/picture/scenery.h"

namespace {

using sim::RenderShape;
using sim::Vec3;

// Three right angles that are no coordinate axes.
const std::array<Vec3, 3> kAxes{Vec3(2, 1, 2) / 3, Vec3(-2, 2, 1) / 3, Vec3(-1, -2, 2) / 3};
const Vec3 kOffset(0.25, -2, 4);

struct SolidMesh {
  sim::Picture picture;
  sim::Viewpoint viewpoint;
  Vec3 offset;

  explicit SolidMesh(const RenderShape& solid, const Vec3& aside = kOffset) : offset(aside) {
    viewpoint.origin = {0.5, 0.25, -1};
    viewpoint.scale = 0.125;
    picture.skins.resize(2);
    sim::add_solid(picture, solid, viewpoint, offset, 1);
  }
  // A point in metres, without the offset.
  Vec3 at(int i) const {
    const sim::V3& p = picture.points[static_cast<std::size_t>(i)];
    return Vec3(p.x, p.y, p.z) / viewpoint.scale + viewpoint.origin - offset;
  }
  Vec3 normal(int i) const {
    const sim::V3& n = picture.normals[static_cast<std::size_t>(i)];
    return {n.x, n.y, n.z};
  }
  int size() const { return static_cast<int>(picture.points.size()); }
  // By the divergence theorem, about a point; of a mesh without holes it is the same about all.
  double volume(const Vec3& about) const {
    double sum = 0;
    for (const auto& t : picture.triangles) {
      const Vec3 a = at(t.points[0]) - about, b = at(t.points[1]) - about,
                 c = at(t.points[2]) - about;
      sum += a.dot(b.cross(c)) / 6;
    }
    return sum;
  }
  // Faces look where the normals of their corners look.
  void check_faces() const {
    for (const auto& t : picture.triangles) {
      CHECK(t.skin == 1);
      CHECK(t.visible);
      const Vec3 a = at(t.points[0]), b = at(t.points[1]), c = at(t.points[2]);
      const Vec3 face = (b - a).cross(c - a);
      if (face.norm() < 1e-6) continue;  // at a pole
      for (const int i : t.points) CHECK(normal(i).dot(face) > 0.9 * face.norm());
    }
  }
};

}  // namespace

TEST_CASE("the triangles of a box are its faces") {
  RenderShape box{.form = RenderShape::Form::kBox, .center = {1, 2, 3}};
  const Vec3 half(0.5, 1, 0.25);
  for (std::size_t k = 0; k < 3; ++k) box.axes[k] = half[k] * kAxes[k];
  const SolidMesh mesh(box);
  CHECK(mesh.picture.triangles.size() == 12);
  std::map<std::size_t, int> faces;
  for (int i = 0; i < mesh.size(); ++i) {
    // Each point is a corner, and its normal one of the axes there.
    const Vec3 d = mesh.at(i) - box.center;
    int own = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double along = kAxes[k].dot(d);
      CHECK(std::abs(along) == Approx(half[k]).epsilon(1e-5));
      if (std::abs(kAxes[k].dot(mesh.normal(i))) < 0.5) continue;
      ++own;
      CHECK((mesh.normal(i) - (along > 0 ? 1 : -1) * kAxes[k]).norm() < 1e-6);
      ++faces[2 * k + (along > 0 ? 1 : 0)];
    }
    CHECK(own == 1);
  }
  CHECK(faces.size() == 6);
  for (const auto& [face, corners] : faces) CHECK(corners == 4);
  for (const Vec3& about : {box.center, Vec3(9, -7, 5)})
    CHECK(mesh.volume(about) == Approx(8 * half[0] * half[1] * half[2]).epsilon(1e-4));
  mesh.check_faces();
}

TEST_CASE("the triangles of a capsule lie on it and enclose it") {
  for (const double length : {0.75, 0.0}) {
    RenderShape capsule{.form = RenderShape::Form::kCapsule, .center = {-1, 0.5, 2}};
    capsule.axes[0] = length * kAxes[1], capsule.radius = 0.5;
    const SolidMesh mesh(capsule);
    for (int i = 0; i < mesh.size(); ++i) {
      const Vec3 d = mesh.at(i) - capsule.center;
      const Vec3 nearest = std::clamp(kAxes[1].dot(d), -length, length) * kAxes[1];
      CHECK((d - nearest).norm() == Approx(capsule.radius).epsilon(1e-5));
      if (length > 0) CHECK((mesh.normal(i) - (d - nearest) / capsule.radius).norm() < 1e-5);
    }
    // Flat faces between points of it enclose less, by 2 % at most.
    constexpr double kPi = 3.14159265358979323846;
    const double whole =
        kPi * capsule.radius * capsule.radius * (2 * length + 4.0 / 3 * capsule.radius);
    for (const Vec3& about : {capsule.center, Vec3(4, 4, -4)}) {
      CHECK(mesh.volume(about) < whole);
      CHECK(mesh.volume(about) > 0.98 * whole);
    }
    mesh.check_faces();
  }
}

TEST_CASE("a plane is a large square at its place, unless it is the ground") {
  const Vec3 point(3, 1, -2);
  const SolidMesh mesh(sim::plane_shape(point, kAxes[2]));
  REQUIRE(mesh.size() == 4);
  CHECK(mesh.picture.triangles.size() == 2);
  for (int i = 0; i < 4; ++i) {
    CHECK(kAxes[2].dot(mesh.at(i) - point) == Approx(0).margin(1e-5));
    CHECK((mesh.normal(i) - kAxes[2]).norm() < 1e-6);
    // The square is about the origin of the picture, with sides of 2.2 units.
    const Vec3 next = mesh.at((i + 1) % 4) - mesh.at(i);
    CHECK(next.norm() == Approx(2.2 / mesh.viewpoint.scale).epsilon(1e-5));
  }
  mesh.check_faces();
  CHECK(SolidMesh(sim::plane_shape(point, {0, 1, 0})).size() == 0);
}

TEST_CASE("a solid of triangles has those, and a ball is none") {
  RenderShape solid{.form = RenderShape::Form::kMesh, .center = {1, 1, 1}, .axes = kAxes};
  const auto shape = std::make_shared<sim::RigidShape>();
  shape->form = sim::RigidShape::Form::kMesh;
  shape->points = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}};
  shape->triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  solid.mesh = shape;
  const SolidMesh mesh(solid);
  REQUIRE(mesh.size() == 12);
  for (std::size_t t = 0; t < 4; ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& p = shape->points[static_cast<std::size_t>(shape->triangles[t][k])];
      const Vec3 place = solid.center + p[0] * kAxes[0] + p[1] * kAxes[1] + p[2] * kAxes[2];
      CHECK((mesh.at(mesh.picture.triangles[t].points[k]) - place).norm() < 1e-5);
    }
  CHECK(mesh.volume({0, 0, 0}) == Approx(1).epsilon(1e-4));
  mesh.check_faces();

  RenderShape ball{.form = RenderShape::Form::kSphere, .center = {2, 0, 1}};
  ball.radius = 4;
  const SolidMesh round(ball);
  CHECK(round.size() == 0);
  REQUIRE(round.picture.balls.size() == 1);
  CHECK(round.picture.balls[0].radius == 0.5F);
  CHECK(round.picture.balls[0].centre.x == static_cast<float>(0.125 * (2 + 0.25 - 0.5)));
  CHECK(round.picture.balls[0].centre.y == static_cast<float>(0.125 * (0 - 2 - 0.25)));
  CHECK(round.picture.balls[0].centre.z == static_cast<float>(0.125 * (1 + 4 + 1)));
}

TEST_CASE("of a room the twelve edges are drawn, and of a box its outline") {
  RenderShape box{.form = RenderShape::Form::kBox, .center = {1, 2, 3}};
  const Vec3 half(0.5, 1, 0.25);
  for (std::size_t k = 0; k < 3; ++k) box.axes[k] = half[k] * kAxes[k];
  for (const bool room : {false, true}) {
    box.inside = room;
    const SolidMesh mesh(box);
    CHECK(mesh.picture.triangles.size() == (room ? 0 : 12));
    REQUIRE(mesh.picture.lines.size() == 12);
    std::array<int, 3> along{};  // each axis
    for (const sim::PictureLine& line : mesh.picture.lines) {
      const auto corner = [&](const sim::V3& p) {
        return Vec3(p.x, p.y, p.z) / mesh.viewpoint.scale + mesh.viewpoint.origin - kOffset -
               box.center;
      };
      const Vec3 a = corner(line.a), b = corner(line.b);
      for (std::size_t k = 0; k < 3; ++k) {
        CHECK(std::abs(kAxes[k].dot(a)) == Approx(half[k]).epsilon(1e-5));
        CHECK(std::abs(kAxes[k].dot(b)) == Approx(half[k]).epsilon(1e-5));
        along[k] += kAxes[k].dot(a) * kAxes[k].dot(b) < 0;
      }
    }
    CHECK(along == std::array<int, 3>{4, 4, 4});
  }
}

// A cube of twelve triangles has diagonals on its sides. A roof whose halves are turned by 30
// degrees has no ridge, one of 50 degrees has.
TEST_CASE("edges of a mesh are sharp where its faces are turned by 40 degrees") {
  sim::RigidShape cube;
  for (int i = 0; i < 8; ++i) cube.points.emplace_back(i & 1, i >> 1 & 1, i >> 2);
  for (const auto& [a, b, c, d] :
       {std::array{0, 2, 3, 1}, std::array{4, 5, 7, 6}, std::array{0, 1, 5, 4},
        std::array{2, 6, 7, 3}, std::array{0, 4, 6, 2}, std::array{1, 3, 7, 5}}) {
    cube.triangles.push_back({a, b, c});
    cube.triangles.push_back({a, c, d});
  }
  const auto edges = sim::sharp_edges(cube);
  CHECK(edges.size() == 12);
  for (const auto& [a, b] : edges)
    CHECK((cube.points[static_cast<std::size_t>(a)] - cube.points[static_cast<std::size_t>(b)])
              .norm() == 1);
  for (const double degrees : {30, 50}) {
    const double fall = std::tan(degrees / 2 * 3.14159265358979 / 180);
    sim::RigidShape roof;
    roof.points = {{0, 0, 0}, {0, 0, 1}, {1, -fall, 0}, {-1, -fall, 0}};
    roof.triangles = {{0, 1, 2}, {1, 0, 3}};
    CHECK(sim::sharp_edges(roof).size() == (degrees > 40 ? 5 : 4));  // with the four of its border
  }
}

TEST_CASE("what is hollow or nowhere is not drawn") {
  RenderShape box{.form = RenderShape::Form::kBox};
  CHECK(SolidMesh(box).size() == 24);
  for (const double bad : {std::nan(""), HUGE_VAL}) {
    RenderShape nowhere = box;
    nowhere.center[1] = bad;
    CHECK(SolidMesh(nowhere).size() == 0);
    nowhere = box;
    nowhere.axes[2][0] = bad;
    CHECK(SolidMesh(nowhere).size() == 0);
    nowhere.inside = true;
    CHECK(SolidMesh(nowhere).picture.lines.empty());
  }
}
