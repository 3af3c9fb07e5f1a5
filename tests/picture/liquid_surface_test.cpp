// Liquids drawn as surfaces: closed, around as much room as the liquid has.
#include "core/picture/liquid_surface.h"

#include <catch2/catch.hpp>
#include <map>

#include "core/picture/scenery.h"

namespace {

using sim::Vec3;

constexpr double kSpacing = 0.01, kRadius = 0.1;  // m

// A ball of particles around a point, on a lattice.
std::vector<Vec3> drop(const Vec3& middle) {
  std::vector<Vec3> particles;
  const int n = static_cast<int>(kRadius / kSpacing);
  for (int i = -n; i <= n; ++i)
    for (int j = -n; j <= n; ++j)
      for (int k = -n; k <= n; ++k) {
        const Vec3 x = kSpacing * Vec3(i, j, k);
        if (x.norm() <= kRadius) particles.push_back(middle + x);
      }
  return particles;
}

double volume(const sim::LiquidSurface& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const auto at = [&](std::size_t k) { return mesh.points[static_cast<std::size_t>(t[k])]; };
    sum += at(0).dot(at(1).cross(at(2))) / 6;
  }
  return sum;
}

// Edges that do not have one triangle on each side, with opposite directions.
int open_edges(const sim::LiquidSurface& mesh) {
  std::map<std::array<int, 2>, int> balance;
  for (const auto& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      balance[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  int open = 0;
  for (const auto& [edge, count] : balance) open += count != 0;
  return open;
}

}  // namespace

TEST_CASE("the surface of a drop is closed, around its volume") {
  for (const Vec3& middle : {Vec3(0, 0, 0), Vec3(1e3, -2e3, 5)}) {
    const std::vector<Vec3> particles = drop(middle);
    const std::vector<double> values(particles.size(), 3.0);
    const sim::LiquidSurface mesh = sim::liquid_surface(particles, kSpacing, values);
    CHECK(open_edges(mesh) == 0);
    // A particle of the lattice stands for one of its cells.
    const double expected = static_cast<double>(particles.size()) * kSpacing * kSpacing * kSpacing;
    CHECK(volume(mesh) == Approx(expected).epsilon(0.06));
    REQUIRE(mesh.values.size() == mesh.points.size());
    for (const double value : mesh.values) REQUIRE(value == Approx(3).epsilon(1e-5));
    for (const Vec3& x : mesh.points)
      REQUIRE((x - middle).norm() == Approx(kRadius).margin(kSpacing));
  }
}

TEST_CASE("drops that fly off leave a surface that is coarser") {
  std::vector<Vec3> particles = drop({0, 0, 0});
  particles.push_back({1e3, 2e3, 3e3});
  CHECK(open_edges(sim::liquid_surface(particles, kSpacing, {})) == 0);
  CHECK(sim::liquid_surface(particles, 0, {}).triangles.empty());
  CHECK(sim::liquid_surface({}, kSpacing, {}).triangles.empty());
}

TEST_CASE("a liquid has a surface instead of balls, but for what is pinned or joined") {
  sim::Model model;
  model.name = "water";
  model.second_order = true;
  sim::Frame frame;
  for (const Vec3& x : drop({0, 0, 0})) frame.x.insert(frame.x.end(), x.begin(), x.end());
  model.particles = static_cast<int>(frame.x.size() / 3);
  frame.v.assign(frame.x.size(), 1.0);
  model.mass.assign(static_cast<std::size_t>(model.particles), 1.0);
  model.pinned = {5};
  model.ties = {{sim::ModelPoint{1, {7}}, sim::ModelPoint{1, {8}}}};
  const std::vector<sim::Model> models{model};
  const std::vector<sim::Moment> moments{{frame}};
  CHECK(sim::liquid_of(model).size() == static_cast<std::size_t>(model.particles) - 3);
  CHECK(sim::liquid_spacing(frame, sim::liquid_of(model)) == Approx(kSpacing));
  sim::Look look;
  look.surface = true;
  const sim::Picture picture = sim::Scenery(models, moments, look).picture(0);
  CHECK(picture.balls.size() == 3);
  CHECK(picture.triangles.size() > 1000);
  CHECK(picture.colours.empty());
  look.colour = "speed";
  const sim::Picture coloured = sim::Scenery(models, moments, look).picture(0);
  CHECK(coloured.colours.size() == coloured.points.size());
  look.surface = false;
  const sim::Picture balls = sim::Scenery(models, moments, look).picture(0);
  CHECK(balls.balls.size() == static_cast<std::size_t>(model.particles));
  CHECK(balls.triangles.empty());
}
