// Pieces of rods, welds and curves come to rest where statics says.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "core/study/rest.h"
#include "tests/support/constrained_run.h"

namespace sim::test {
namespace {

// The discrete catenary: n rods of length l hang between (0, 0) and (span, 0), with a mass m at
// each joint. Rod k = 1 .. n bears H along x and m g (k - (n + 1) / 2) along y, and H is where
// their lengths along x add up to the span.
struct Catenary {
  std::vector<Vec3> points;
  double end_force = 0;  // N
};

Catenary catenary(int n, double l, double span, double m) {
  const auto rise = [&](int k) { return m * kG * (k - 0.5 * (n + 1)); };
  const auto across = [&](double h) {
    double sum = 0;
    for (int k = 1; k <= n; ++k) sum += l * h / std::hypot(h, rise(k));
    return sum;
  };
  double low = 0, high = 1e6 * m * kG * n;
  for (int halving = 0; halving < 200; ++halving) {
    const double middle = 0.5 * (low + high);
    (across(middle) < span ? low : high) = middle;
  }
  Catenary found{{Vec3::Zero()}, std::hypot(low, rise(1))};
  for (int k = 1; k <= n; ++k) {
    const double size = std::hypot(low, rise(k));
    found.points.push_back(found.points.back() + l * Vec3(low / size, rise(k) / size, 0));
  }
  return found;
}

// It begins as a triangle: two straight halves.
std::string hanging_chain(int n, double span) {
  return "local n, span = " + std::to_string(n) + ", " + std::to_string(span) + R"(
local p = sim.particles { mass = 2 / n }
local dip = math.sqrt(1 - span * span) / 2
for i = 0, n do p:add { span * i / n, dip * (math.abs(2 * i / n - 1) - 1), 0 } end
p:pin(0, n)
local ties = {}
for i = 1, n do ties[i] = { i - 1, i } end
return sim.scene { particles = p, forces = { sim.force.gravity { g = {0, -9.81, 0} } },
  constraints = { sim.constraint.distance { ties = ties, length = 1 / n } },
  integrator = 'verlet', dt = 0.001, duration = 1 }
)";
}

TEST_CASE("a chain of rods comes to rest in the discrete catenary") {
  for (const int n : {2, 10, 60, 1000}) {
    INFO(n);
    const double span = 0.6;
    HeldRun run(hanging_chain(n, span), "verlet", 0.001);
    const double before = run.system.energy().potential;
    const study::Rest rest = study::come_to_rest(run.system);
    REQUIRE(rest.found);
    const Catenary expected = catenary(n, 1.0 / n, span, 2.0 / n);
    double off = 0;
    for (int i = 0; i <= n; ++i)
      off = std::max(
          off, (run.system.position(i) - expected.points[static_cast<std::size_t>(i)]).norm());
    CHECK(1e10 * off < 1);
    CHECK(run.forces().front().tension == Approx(expected.end_force).epsilon(1e-9));
    CHECK(rest.potential <= before);
    CHECK(run.system.constraint_system()->drift(0, run.system.state().data()).position < 1e-13);
    CHECK(rest.effort.newton < 150);
  }
}

std::string two_rods(const std::string& end) {
  return held_scene("{0, 0, 0}, {0.001, 1, 0}, " + end, "{0, 1}, {1, 2}", "", "p:pin(0)");
}

TEST_CASE("rods that stand on end fall to where they hang") {
  for (const std::string end : {"{0, 2, 0}", "{0.3, 1.2, 0.1}"}) {
    HeldRun run(two_rods(end), "rk4", 0.01);
    const double length = (run.system.position(2) - run.system.position(1)).norm();
    REQUIRE(study::come_to_rest(run.system).found);
    const double first = std::hypot(1, 0.001);
    CHECK((run.system.position(1) - Vec3(0, -first, 0)).norm() < 1e-7);
    CHECK((run.system.position(2) - Vec3(0, -first - length, 0)).norm() < 1e-7);
  }
}

TEST_CASE("rods that follow from others do no harm to a search for rest") {
  HeldRun run(held_scene("{0, 0, 0}, {1, 0, 0}, {1, 0, 1}", "{0, 1}, {1, 2}, {0, 2}, {0, 1}", "",
                         "p:pin(0)"),
              "rk4", 0.01);
  const study::Rest rest = study::come_to_rest(run.system);
  REQUIRE(rest.found);
  // The middle of the two lies below the support.
  const Vec3 middle = 0.5 * (run.system.position(1) + run.system.position(2));
  CHECK(std::hypot(middle.x(), middle.z()) < 1e-9);
  CHECK(middle.y() == Approx(-std::sqrt((1 + 2) / 2.0 - 0.25)).epsilon(1e-12));
}

// A bead on the helix (cos s, s / 5, sin s) on a spring of no length to the point (0, 1, 0):
// U = m g s / 5 + k / 2 (1 + (s / 5 - 1)^2) is least where s / 5 = 1 - m g / k.
TEST_CASE("a bead on a curve rests where the slope of its potential ends") {
  const double m = 0.2, k = 20;
  HeldRun run(R"(
local p = sim.particles { mass = 0.2 }
p:add { 1, 0, 0 }
p:add { 0, 1, 0 }
p:pin(1)
local function helix(s) return { math.cos(s), s / 5, math.sin(s) } end
return sim.scene { particles = p, forces = { sim.force.gravity { g = {0, -9.81, 0} },
    sim.force.spring { stiffness = 20, rest = 0, ties = { {0, 1} } } },
  constraints = { sim.constraint.on_curve { particles = {0}, curve = helix } },
  integrator = 'rk4', dt = 0.002, duration = 2 }
)",
              "rk4", 0.002);
  REQUIRE(study::come_to_rest(run.system).found);
  const double height = 1 - m * kG / k;
  const Vec3 at = run.system.position(0);
  CHECK(at.y() == Approx(height).epsilon(1e-9));
  CHECK((at - Vec3(std::cos(5 * height), height, std::sin(5 * height))).norm() < 1e-8);
}

TEST_CASE("a rod that falls freely has no rest") {
  HeldRun run(held_scene("{0, 0, 0}, {1, 0, 0}", "{0, 1}", ""), "rk4", 0.01);
  const study::Rest rest = study::come_to_rest(run.system);
  CHECK(!rest.found);
  CHECK_THAT(rest.why, Catch::Contains("moves away"));
}

TEST_CASE("a search for rest stops when asked") {
  HeldRun run(hanging_chain(60, 0.6), "verlet", 0.001);
  int asked = 0;
  // Asked before the first step, and before each iteration in it.
  const study::Rest rest = study::come_to_rest(run.system, [&] { return ++asked > 2; });
  CHECK(!rest.found);
  CHECK(rest.why == "interrupted");
  CHECK(rest.effort.newton == 1);
}

}  // namespace
}  // namespace sim::test
