// Surfaces that do not pass through themselves or each other: no crossings after any step, momentum
// and energy of what contact did.
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "tests/support/sheets.h"

using namespace sim_test;
using sim::Vec3;

namespace {

struct Outcome {
  std::int64_t crossings = 0, most_zones = 0, steps = 0;
  double momentum_change = 0, energy_rise = 0;  // kg m/s; J above what is allowed, in a step
};

Outcome run(const sim::SystemSpec& spec, int steps, int every = 1, bool compare = true) {
  sim::Registry registry = make_registry();
  sim::Simulation system(spec, registry);
  WithoutContact free(spec, registry);
  Outcome outcome;
  for (int n = 0; n < steps; ++n) {
    const double before = system.energy().total();
    if (compare) REQUIRE(free.step_from(system));
    if (!system.step()) {
      FAIL(system.divergence().why);
    }
    if (compare) {
      outcome.momentum_change = std::max(outcome.momentum_change, free.momentum_change(system));
      const double allowed = std::max(before, free.system().energy().total());
      outcome.energy_rise = std::max(outcome.energy_rise, system.energy().total() - allowed);
    }
    if (n % every == 0 || n + 1 == steps) outcome.crossings += crossings(system, spec);
  }
  check_words_of_contact(system);
  CHECK(figure_of(system, "shortened") == 0);  // there are no constraints
  outcome.most_zones = static_cast<std::int64_t>(figure_of(system, "zones"));
  outcome.steps = static_cast<std::int64_t>(figure_of(system, "steps"));
  return outcome;
}

}  // namespace

TEST_CASE("a random crumple never crosses itself, and loses energy alone") {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(-1, 1);
  int crumples = 10;
  if (const char* many = getenv("CRUMPLES")) crumples = atoi(many);
  for (int trial = 0; trial < crumples; ++trial) {
    const SheetOptions options{.n = 12, .stiffness = trial % 2 ? 20.0 : 2.0};
    double a[6];
    for (double& number : a) number = uniform(random);
    sim::SystemSpec spec = make_sheets(1, options, [&](int, double u, double v) {
      return Vec3(u - 0.5, 0.1 * (a[0] * std::sin(5 * u) + a[1] * std::sin(6 * v)), v - 0.5);
    });
    const double speed = 2 + 2 * (trial % 5);
    for (auto& particle : spec.particles->list) {
      const Vec3 x = particle.position;
      particle.velocity =
          -speed * x + 0.3 * speed * Vec3(uniform(random), 0, 0) +
          speed * Vec3(0, a[2] * std::sin(9 * x.x()) + a[3] * std::sin(7 * x.z()), 0);
    }
    spec.dt = std::min(spec.dt, 0.02);
    INFO("crumple " << trial << " speed " << speed << " dt " << spec.dt);
    const Outcome outcome = run(spec, std::min(400, static_cast<int>(1.2 / spec.dt)));
    UNSCOPED_INFO("zones " << outcome.most_zones << " steps " << outcome.steps);
    CHECK(outcome.crossings == 0);
    CHECK(outcome.steps > 5);
    CHECK(outcome.momentum_change < 1e-12);
    CHECK(outcome.energy_rise < 1e-12);
    if (getenv("CRUMPLES"))
      printf("%d dt %g speed %g: steps %ld zones %ld mom %g energy %g\n", trial, spec.dt, speed,
             outcome.steps, outcome.most_zones, outcome.momentum_change, outcome.energy_rise);
  }
}

TEST_CASE("two sheets thrown at each other never cross, at any speed") {
  for (const double speed : {0.5, 5.0, 50.0, 500.0})
    for (const double dt : {0.001, 0.005, 0.02}) {
      const double stiffness = 0.1 / (144 * 2 * dt * dt * 4);
      sim::SystemSpec spec = make_sheets(
          2, {.n = 12, .stiffness = std::min(stiffness, 100.0)}, [](int sheet, double u, double v) {
            // turned by 30 degrees against each other
            const Vec3 at(u - 0.5, 0.1 * sheet + 0.03 * u * v, v - 0.5);
            return sheet == 0
                       ? at
                       : Vec3(0.866 * at.x() - 0.5 * at.z(), at.y(), 0.5 * at.x() + 0.866 * at.z());
          });
      for (std::size_t i = spec.particles->list.size() / 2; i < spec.particles->list.size(); ++i)
        spec.particles->list[i].velocity = {0.1 * speed, -speed, 0};
      spec.dt = dt;
      INFO("speed " << speed << " dt " << dt);
      const Outcome outcome = run(spec, 60);
      UNSCOPED_INFO("zones " << outcome.most_zones << " steps " << outcome.steps);
      CHECK(outcome.crossings == 0);
      CHECK(outcome.momentum_change < 1e-12 * std::max(1.0, speed));
      CHECK(outcome.energy_rise < 1e-12 * std::max(1.0, speed * speed));
      if (getenv("CRUMPLES"))
        printf("speed %g dt %g: steps %ld zones %ld mom %g energy %g\n", speed, dt, outcome.steps,
               outcome.most_zones, outcome.momentum_change, outcome.energy_rise);
    }
}

namespace {

// A sheet rolled up against itself by its own velocity, at once.
sim::SystemSpec make_rolling(int n) {
  sim::SystemSpec spec = make_sheets(1, {.n = n, .stiffness = 30}, [](int, double u, double v) {
    return Vec3(u - 0.5, 0.05 * std::sin(6 * u) * std::cos(5 * v), v - 0.5);
  });
  for (auto& particle : spec.particles->list) {
    const Vec3 x = particle.position;
    particle.velocity = Vec3(-6 * x.x(), 3 * std::sin(8 * x.x()), -4 * x.z());
  }
  return spec;
}

}  // namespace

TEST_CASE("contact has the same bits on any number of threads, and after any way back") {
  const sim::SystemSpec spec = make_rolling(72);
  sim::Registry registry = make_registry();
  sim::Simulation one(spec, registry), two(spec, registry, {.threads = 2});
  for (int n = 0; n < 150; ++n) REQUIRE((one.step() && two.step()));
  REQUIRE(figure_of(one, "steps") > 20);
  CHECK(one.hash() == two.hash());
  const sim::Snapshot then = one.snapshot();
  for (int n = 0; n < 20; ++n) REQUIRE(one.step());
  const std::uint64_t end = one.hash();
  one.restore(then);
  for (int n = 0; n < 20; ++n) REQUIRE(one.step());
  CHECK(one.hash() == end);
  sim::Simulation other(spec, registry);  // whose lists of pairs have another past
  other.restore(then);
  for (int n = 0; n < 20; ++n) REQUIRE(other.step());
  CHECK(other.hash() == end);
  other.reset();
  for (int n = 0; n < 150; ++n) REQUIRE(other.step());
  CHECK(other.hash() == two.hash());
}

TEST_CASE("surfaces do not cross under any method of fixed steps") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_rolling(10);
  int methods = 0;
  for (const std::string& method : methods_for(spec, registry)) {
    INFO(method);
    sim::SystemSpec bare = spec;
    bare.contact.reset();
    if (sim::Simulation(bare, registry, {.integrator = {method}}).integrator_info().adaptive) {
      CHECK_THROWS_WITH(sim::Simulation(spec, registry, {.integrator = {method}}),
                        Catch::Contains("fixed steps"));
      continue;
    }
    const double dt = method.starts_with("euler") ? 0.05 * spec.dt : spec.dt;
    sim::Simulation system(spec, registry, {.integrator = {method}, .dt = dt});
    for (int n = 0; n < 80 && system.step(); ++n) REQUIRE(crossings(system, spec) == 0);
    ++methods;
  }
  CHECK(methods >= 8);
}

TEST_CASE("a scene without contact, or whose surfaces stay apart, keeps its bits") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_sheets(
      2, {}, [](int sheet, double u, double v) { return Vec3(u, 0.5 * sheet + 0.01 * u * v, v); });
  sim::SystemSpec bare = spec;
  bare.contact.reset();
  sim::Simulation with(spec, registry), without(bare, registry);
  for (int n = 0; n < 100; ++n) REQUIRE((with.step() && without.step()));
  CHECK(figure_of(with, "steps") == 0);
  CHECK(with.hash() == without.hash());
}

TEST_CASE("a change by hand that would cross is refused and changes nothing") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec =
      make_sheets(2, {}, [](int sheet, double u, double v) { return Vec3(u, 0.1 * sheet, v); });
  sim::Simulation system(spec, registry);
  const std::uint64_t before = system.hash();
  const int middle = 12 * 6 + 6;
  CHECK_THROWS_WITH(system.set_position(middle, system.position(middle) + Vec3(0.01, 0.2, 0.013)),
                    Catch::Contains("cross"));
  CHECK(system.hash() == before);
  system.set_position(middle, system.position(middle) + Vec3(0, 0.05, 0));
  CHECK(system.hash() != before);
}

// A particle of the lower sheet is put through the upper one, which is torn elsewhere, then there.
TEST_CASE("a change by hand through a tear is allowed") {
  sim::Registry registry = make_registry();
  constexpr int kSide = 12, kSheet = kSide * kSide;
  sim::SystemSpec spec =
      make_sheets(2, {}, [](int sheet, double u, double v) { return Vec3(u, 0.1 * sheet, v); });
  for (sim::PartSpec& springs : spec.forces) springs.given["break_strain"] = 9.0;
  sim::Simulation system(spec, registry);
  const int middle = kSide * 6 + 6;
  const Vec3 through = system.position(middle) + Vec3(0.01, 0.2, 0.013);
  // All ties of the upper sheet between particles of these rows and columns.
  const auto tear = [&](int low, int high) {
    const auto inside = [&](int id) {
      const int i = id % kSheet / kSide, j = id % kSide;
      return id >= kSheet && i >= low && i <= high && j >= low && j <= high;
    };
    for (const sim::PartSpec& springs : spec.forces)
      springs.elements.for_each([&](const sim::Element& tie) {
        if (inside(tie.ids[0]) && inside(tie.ids[1])) system.cut(tie.ids[0], tie.ids[1]);
      });
  };
  CHECK_THROWS_WITH(system.set_position(middle, through), Catch::Contains("cross"));
  tear(1, 3);
  CHECK_FALSE(system.torn().empty());
  CHECK_THROWS_WITH(system.set_position(middle, through), Catch::Contains("cross"));
  tear(5, 8);
  CHECK_NOTHROW(system.set_position(middle, through));
  CHECK(system.position(middle) == through);
}

TEST_CASE("cloth on colliders does not cross, and no particle is inside") {
  sim::Registry registry = make_registry();
  for (const double dt : {0.001, 0.005, 0.02}) {
    const double stiffness = std::min(60.0, 0.05 / (144 * dt * dt));
    sim::SystemSpec spec =
        make_sheets(3, {.stiffness = stiffness}, [](int sheet, double u, double v) {
          const Vec3 at(u - 0.5, 0.1 + 0.06 * sheet, v - 0.5);
          const double c = std::cos(0.7 * sheet), s = std::sin(0.7 * sheet);
          return Vec3(c * at.x() - s * at.z(), at.y(), s * at.x() + c * at.z());
        });
    spec.forces.push_back(make_gravity());
    spec.forces.push_back(make_drag(0.5 / 144));
    spec.colliders = {
        make_part("sphere", {{"radius", 0.25}, {"center", Vec3(0, -0.2, 0)}, {"friction", 0.2}}),
        make_part("plane", {{"point", Vec3(0, -0.3, 0)}, {"friction", 0.3}})};
    spec.dt = dt;
    INFO("dt " << dt);
    sim::Simulation system(spec, registry);
    for (int n = 0; n < static_cast<int>(1 / dt); ++n) {
      REQUIRE(system.step());
      if (n % 10 == 0 || dt > 0.002) REQUIRE(crossings(system, spec) == 0);
    }
    if (getenv("CRUMPLES"))
      printf("dt %g deepest %g zones %g\n", dt, figure_of(system, "deepest"),
             figure_of(system, "zones"));
    CHECK(figure_of(system, "deepest") <
          0.1 * std::get<double>(spec.contact->given.at("thickness")));
  }
}

TEST_CASE("limited strain keeps edges short, momentum, and surfaces apart") {
  sim::Registry registry = make_registry();
  double longest[2];
  for (const bool limited : {false, true}) {
    sim::SystemSpec spec = make_sheets(1, {.n = 10, .stiffness = 3}, [](int, double u, double v) {
      return Vec3(u - 0.5, 0.02 * std::sin(7 * u + 3 * v), v - 0.5);
    });
    for (auto& particle : spec.particles->list) {  // torn apart, and turned
      const Vec3 x = particle.position;
      particle.velocity = Vec3(3 * x.x() - 2 * x.z(), std::sin(9 * x.x()), 2 * x.x() + 3 * x.z());
    }
    if (limited) spec.contact->given["strain_limit"] = 0.1;
    spec.dt = 0.005;
    sim::Simulation system(spec, registry);
    const Vec3 start = momentum(system, spec);
    double most = 0, highest = system.energy().total();
    for (int n = 0; n < 200; ++n) {
      const double before = system.energy().total();
      REQUIRE(system.step());
      REQUIRE(crossings(system, spec) == 0);
      if (limited) CHECK(system.energy().total() < before + 0.02 * highest);
      for (const auto& edge : spec.surfaces[0]->edges()) {
        const auto [a, b] = edge.ends;
        const double first =
            (spec.particles->at(a).position - spec.particles->at(b).position).norm();
        most = std::max(most, (system.position(a) - system.position(b)).norm() / first - 1);
      }
    }
    longest[limited] = most;
    CHECK((momentum(system, spec) - start).norm() < 1e-13);
  }
  CHECK(longest[0] > 0.4);
  CHECK(longest[1] < 0.12);
}
