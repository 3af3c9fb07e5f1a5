// The layout of a state: parts, places, padding.
#include <catch2/catch.hpp>
#include <set>

#include "core/ode/state_shape.h"
#include "tests/support/scenes.h"

using namespace sim_test;

namespace {

// Every number is in one range and in one part.
void check_cover(const sim::StateShape& shape) {
  std::set<std::size_t> in_ranges, in_parts;
  std::size_t last = 0;
  for (const auto& [begin, end] : shape.ranges()) {
    CHECK(begin >= last);
    CHECK(end <= shape.size());
    for (std::size_t i = begin; i < end; ++i) in_ranges.insert(i);
    last = end;
  }
  shape.each([&](const sim::StateNumber& number) {
    CHECK(in_parts.insert(number.at).second);
    return true;
  });
  CHECK(in_parts == in_ranges);
}

}  // namespace

TEST_CASE("a flat list and points are their own ranges") {
  const sim::StateShape flat = sim::StateShape::flat(5), points = sim::StateShape::points(4);
  check_cover(flat);
  check_cover(points);
  REQUIRE(points.ranges().size() == 1);
  CHECK(points.ranges().front().end == 12);
  CHECK(points.first().at(2, 1) == 7);
  CHECK_FALSE(flat.find("position"));
}

TEST_CASE("the state of particles is positions, velocities and what forces remember") {
  sim::Registry registry = make_registry();
  for (const int n : {3, 7, 40}) {
    sim::SystemSpec spec = make_cloth(n);
    for (const int seed : {1, 2})
      spec.forces.push_back(make_part("gust", {{"c", 0.1}, {"seed", std::int64_t{seed}}}));
    const sim::Simulation simulation(spec, registry);
    const sim::StateShape& shape = simulation.shape();
    CHECK(shape.size() == simulation.state().size());
    check_cover(shape);
    REQUIRE(shape.parts().size() == 4);
    CHECK(shape.parts()[2].name == "memory of 'gust'");
    CHECK(shape.parts()[3].name == "memory of 'gust' 2");
    const auto place = [&](const char* part, int i, int axis) {
      return shape.find(part)->at(static_cast<std::size_t>(i), static_cast<std::size_t>(axis));
    };
    for (const int i : {0, n, n * n - 1})
      for (int axis = 0; axis < 3; ++axis) {
        CHECK(simulation.state()[place("position", i, axis)] == simulation.position(i)[axis]);
        CHECK(simulation.state()[place("velocity", i, axis)] == simulation.velocity(i)[axis]);
      }
    // Particle by particle, then the memories.
    std::vector<std::string> names;
    shape.each([&](const sim::StateNumber& number) {
      names.push_back(number.name());
      return names.size() < 7;
    });
    CHECK(names == std::vector<std::string>{"x", "y", "z", "vx", "vy", "vz", "x"});
  }
}

// A view of a temporary shape would dangle.
template <class Shape>
concept GivesViews = requires(Shape&& shape) {
  std::forward<Shape>(shape).parts();
}
|| requires(Shape&& shape) { std::forward<Shape>(shape).ranges(); }
|| requires(Shape&& shape) { std::forward<Shape>(shape).first(); }
|| requires(Shape&& shape) { std::forward<Shape>(shape).find(""); };
static_assert(GivesViews<const sim::StateShape&> && !GivesViews<sim::StateShape>);
