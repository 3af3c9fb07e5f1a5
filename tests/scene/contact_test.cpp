// Contact with solid bodies: friction, motion, energy, and that nothing gets inside.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/geometry/rigid_motion.h"
#include "core/math/sine.h"
#include "core/study/energy_balance.h"
#include "tests/support/scenes.h"
#include "tests/support/table.h"

using namespace sim_test;
using sim::Vec3;

namespace {

std::shared_ptr<const sim::RigidMotion> make_motion(sim::Registry& registry,
                                                    const std::string& name,
                                                    std::map<std::string, sim::Value> given) {
  const auto& plugin = registry.get<sim::RigidMotion>(name);
  return plugin.make(sim::Params(plugin.title(), plugin.params, given, {}));
}

// The imbalance of the energy at the end of a run, J; `work` receives the work of contact.
double imbalance(sim::Simulation& system, int steps, sim::ContactWork* work = nullptr) {
  sim::study::EnergyBalance balance(system);
  for (int n = 0; n < steps; ++n) {
    REQUIRE(system.step());
    balance.advance();
    balance.look();
  }
  if (work) *work = balance.contact();
  return std::abs(balance.error());
}

}  // namespace

TEST_CASE("sine and cosine of turns") {
  for (int n = -4000; n < 4000; ++n) {
    const double turns = 0.00137 * n + 7 * (n % 5);
    const auto [sine, cosine] = sim::sine_cosine(turns);
    const long double angle = 6.283185307179586476925L * static_cast<long double>(turns);
    CHECK(std::abs(sine - static_cast<double>(sinl(angle))) < 2e-14);
    CHECK(std::abs(cosine - static_cast<double>(cosl(angle))) < 2e-14);
    CHECK(std::abs(sine * sine + cosine * cosine - 1) < 1e-15);
  }
  CHECK(sim::sine_cosine(0.25).sine == 1);
  CHECK(sim::sine_cosine(0.5).cosine == -1);
}

TEST_CASE("signed distances of the shapes and their normals") {
  sim::Registry registry = make_registry();
  const std::map<std::string, sim::PartSpec> shapes{
      {"sphere", make_part("sphere", {{"radius", 0.7}})},
      {"plane", make_part("plane", {{"normal", Vec3(3, 4, 0)}, {"point", Vec3(0.15, 0.2, 0)}})},
      {"box", make_part("box", {{"half", Vec3(1, 0.5, 0.25)}})},
      {"rounded_box", make_part("box", {{"half", Vec3(1, 0.5, 0.25)}, {"thickness", 0.125}})},
      {"capsule",
       make_part("capsule",
                 {{"a", Vec3(-0.5, -0.25, 0)}, {"b", Vec3(1, 0.5, 0.25)}, {"radius", 0.3}})},
      {"hollow_sphere", make_part("sphere", {{"radius", 0.7}, {"inside", true}})}};
  const Table table("signed_distance.csv");
  REQUIRE(table.rows().size() == 246);
  for (const Row& row : table.rows()) {
    const sim::PartSpec& part = shapes.at(row.text("shape"));
    const auto& plugin = registry.get<sim::Collider>(part.plugin);
    const auto shape = plugin.make(sim::Params(plugin.title(), plugin.params, part.given, {}));
    const Vec3 x(row.number("x"), row.number("y"), row.number("z"));
    const Vec3 normal(row.number("nx"), row.number("ny"), row.number("nz"));
    const sim::SurfaceSample sample = shape->query(0, x);
    INFO(row.text("shape") << " at " << x[0] << " " << x[1] << " " << x[2]);
    const double size = std::max(1.0, x.norm());
    CHECK(std::abs(sample.gap - row.number("gap")) < 1e-15 * size);
    CHECK(std::abs(sample.normal.norm() - 1) < 1e-15);
    if (normal.norm() > 0) CHECK((sample.normal - normal).norm() < 1e-15 * size);
    // Boxes around the point are no nearer than their nearest point is.
    for (const double half : {0.01, 0.3}) {
      const double clearance = shape->clearance(0, x, Vec3(half, 0.5 * half, half));
      for (int corner = 0; corner < 8; ++corner) {
        const Vec3 at = x + Vec3(corner & 1 ? half : -half, corner & 2 ? 0.5 * half : -0.5 * half,
                                 corner & 4 ? half : -half);
        CHECK(clearance <= shape->query(0, at).gap + 1e-12 * size);
      }
    }
  }
}

TEST_CASE("a turned box and a spinning one are where their turns have led") {
  sim::Registry registry = make_registry();
  const auto& plugin = registry.get<sim::Collider>("box");
  const auto make = [&](std::map<std::string, sim::Value> given) {
    given["half"] = Vec3(1, 0.5, 0.25);
    return plugin.make(sim::Params(plugin.title(), plugin.params, given, {}));
  };
  const double quarter = 1.5707963267948966;
  const auto turned = make({{"turn", Vec3(0, 0, quarter)}});
  CHECK(turned->query(0, {0, 1.5, 0}).gap == Approx(0.5));
  CHECK((turned->query(0, {0, 1.5, 0}).normal - Vec3(0, 1, 0)).norm() < 1e-15);
  const auto spinning =
      make({{"motion", make_motion(registry, "spin", {{"axis", Vec3(0, 0, 2)}, {"period", 4.0}})}});
  CHECK(spinning->query(1, {0, 1.5, 0}).gap == Approx(0.5));
  CHECK((spinning->query(1, {0, 1, 0}).velocity - Vec3(-quarter, 0, 0)).norm() < 1e-15);
  CHECK((spinning->advect(0, 1, {1, 0, 0}) - Vec3(0, 1, 0)).norm() < 1e-15);
  CHECK(spinning->max_speed(0, 1) >= quarter * Vec3(1, 0.5, 0).norm());
}

TEST_CASE("a particle slides down a sphere, with and without friction, and leaves it") {
  sim::Registry registry = make_registry();
  const Table table("sphere_slide.csv");
  REQUIRE(table.rows().size() == 53);
  for (const char* method : {"rk4", "verlet"})
    for (const Row& row : table.rows()) {
      // The third significant digit of the start decides where it leaves on the smallest angle.
      const bool unstable = row.number("case") == 4;
      const double h = 1e-3;
      INFO(method << " case " << row.number("case") << " t " << row.number("t"));
      sim::Simulation slide(make_particle({row.number("x0"), row.number("y0"), 0},
                                          {row.number("vx0"), row.number("vy0"), 0},
                                          make_part("sphere", {{"radius", row.number("radius")},
                                                               {"friction", row.number("mu")}})),
                            registry, {.integrator = {method}, .dt = h});
      sim::ContactWork work;
      const double off =
          imbalance(slide, static_cast<int>(std::lround(row.number("t") / h)), &work);
      const Vec3 x(row.number("x"), row.number("y"), 0), v(row.number("vx"), row.number("vy"), 0);
      CHECK((slide.position(0) - x).norm() < (unstable ? 2e-3 : 3e-6));
      CHECK((slide.velocity(0) - v).norm() < (unstable ? 5e-3 : 1e-5));
      CHECK(off < 5e-6);
      if (row.number("t") > row.number("leaves"))
        CHECK(std::abs(work.lost + row.number("work")) < 1e-5);
    }
}

TEST_CASE("contact is of order two, friction included") {
  sim::Registry registry = make_registry();
  struct Problem {
    const char* name;
    sim::SystemSpec spec;
    double duration, least;
  };
  sim::PartSpec sphere = make_part("sphere", {{"radius", 1.0}});
  sim::PartSpec rough = sphere;
  rough.given["friction"] = 0.2;
  const double c = std::cos(0.5), s = std::sin(0.5);
  const Problem problems[] = {
      {"slides off a sphere", make_particle({0, 1, 0}, {0.5, 0, 0.3}, sphere), 1.2, 1.8},
      {"falls on a sphere", make_particle({0.3, 1.2, 0}, {0, 0, 0}, sphere), 0.9, 1.8},
      {"rough sphere", make_particle({0, 1, 0}, {1.8, 0, 0.3}, rough), 0.5, 1.8},
      {"across a rough slope", make_particle({0, 0, 0}, {0, 0, 2}, make_slope(0.5, 0.3)), 1, 1.8},
      {"up a slope and stays", make_particle({0, 0, 0}, {3 * c, 3 * s, 0}, make_slope(0.5, 0.9)), 1,
       1.8},
      {"up a slope and back", make_particle({0, 0, 0}, {3 * c, 3 * s, 0}, make_slope(0.5, 0.3)), 1,
       1.8}};
  for (const Problem& problem : problems)
    for (const char* method : {"rk4", "verlet"}) {
      const auto end_of = [&](int steps) {
        sim::Simulation run_of(problem.spec, registry,
                               {.integrator = {method}, .dt = problem.duration / steps});
        REQUIRE(run(run_of, steps));
        return run_of.position(0);
      };
      const Vec3 exact = end_of(37 * 1024);
      const double coarse = (end_of(37) - exact).norm(), fine = (end_of(37 * 32) - exact).norm();
      INFO(problem.name << " " << method << " " << coarse << " " << fine);
      CHECK((fine < 1e-11 || std::log2(coarse / fine) / 5 > problem.least));
      CHECK(fine < 4e-6);
    }
}

TEST_CASE("on a rough slope a block slides with g (sin - mu cos), or stays to the bit") {
  sim::Registry registry = make_registry();
  const double alpha = 0.4, c = std::cos(alpha), s = std::sin(alpha);
  for (const char* method : {"rk4", "verlet", "midpoint", "pefrl"}) {
    INFO(method);
    sim::Simulation slides(make_particle({0, 0, 0}, {0, 0, 0}, make_slope(alpha, 0.3)), registry,
                           {.integrator = {method}, .dt = 0.01});
    REQUIRE(run(slides, 100));
    CHECK(slides.position(0).dot(Vec3(-c, -s, 0)) ==
          Approx(0.5 * kGravity * (s - 0.3 * c)).epsilon(1e-12));
    sim::Simulation stays(make_particle({0, 0, 0}, {0, 0, 0}, make_slope(alpha, 0.43)), registry,
                          {.integrator = {method}, .dt = 0.01});
    REQUIRE(run(stays, 1000));
    CHECK(stays.position(0).norm() == 0);
    CHECK(stays.velocity(0).norm() == 0);
  }
}

TEST_CASE("one rough impact gives back what Newton and Coulomb say") {
  sim::Registry registry = make_registry();
  struct Impact {
    Vec3 v, normal;
    double e, mu;
    Vec3 after;
  };
  const Impact impacts[] = {
      {{1, -1, 0}, {0, 1, 0}, 0.5, 0.3, {0.55, 0.5, 0}},
      {{1, -1, 2}, {0, 1, 0}, 1, 0.1, {0.9105572809000084, 1, 1.8211145618000169}},
      {{0.2, -3, 0.1}, {0, 1, 0}, 0, 0.5, {0, 0, 0}},
      {{1, -2, 0.5},
       {0.6, 0.8, 0},
       0.8,
       0.25,
       {1.7307486999476804, -0.29806152496076016, 0.39085896873365017}}};
  for (const Impact& impact : impacts)
    for (const char* method : {"rk4", "verlet"}) {
      sim::PartSpec plane = make_part(
          "plane", {{"normal", impact.normal}, {"restitution", impact.e}, {"friction", impact.mu}});
      sim::Simulation particle(make_particle(-0.007 * impact.v, impact.v, std::move(plane), false),
                               registry, {.integrator = {method}, .dt = 0.01});
      sim::ContactWork work;
      CHECK(imbalance(particle, 1, &work) < 1e-14);
      CHECK((particle.velocity(0) - impact.after).norm() < 1e-13);
      CHECK(work.lost ==
            Approx(0.5 * (impact.v.squaredNorm() - impact.after.squaredNorm())).margin(1e-14));
    }
}

TEST_CASE("what a moving sphere hits flies off with (1 + e) V, and its work is counted") {
  sim::Registry registry = make_registry();
  for (const double e : {0.0, 0.5, 1.0})
    for (const char* method : {"rk4", "verlet", "trapezoid"}) {
      INFO(method << " " << e);
      sim::PartSpec sphere = make_part(
          "sphere", {{"radius", 0.25},
                     {"restitution", e},
                     {"motion", make_motion(registry, "line", {{"velocity", Vec3(3, 0, 0)}})}});
      sim::Simulation hit(make_particle({1, 0, 0}, {0, 0, 0}, std::move(sphere), false), registry,
                          {.integrator = {method}, .dt = 0.013});
      sim::ContactWork work;
      CHECK(imbalance(hit, 40, &work) < 1e-12);
      CHECK((hit.velocity(0) - Vec3((1 + e) * 3, 0, 0)).norm() < 1e-12);
      CHECK(work.given == Approx(3 * 3 * (1 + e)));
      CHECK(work.lost == Approx(4.5 * (1 - e * e)).margin(1e-12));
    }
}

TEST_CASE("nothing goes through a sphere, however fast it is") {
  sim::Registry registry = make_registry();
  for (const char* method : {"rk4", "verlet"})
    for (int n = 0; n < 200; ++n) {
      // 100 radii in one step, from the left and past the middle by up to 0.99 radii.
      const double radius = 0.01, off = 0.99 * radius * (n % 20) / 19.0;
      sim::Simulation shot(make_particle({-0.2 - 0.001 * n, off, 0}, {100, 0, 0},
                                         make_part("sphere", {{"radius", radius}}), false),
                           registry, {.integrator = {method}, .dt = 0.01});
      REQUIRE(shot.step());
      // It slides off inelastically: never straight on.
      CHECK(shot.velocity(0).norm() < 100 * std::sqrt(1 - std::pow(1 - off / radius, 2)) + 50);
      CHECK(shot.position(0).norm() > radius - 1e-12);
      CHECK(shot.velocity(0).y() > (off == 0 ? -1 : 0));
    }
}

TEST_CASE("in a room without gravity a ball keeps its speed and its place to rounding") {
  sim::Registry registry = make_registry();
  sim::PartSpec room = make_part("box", {{"half", Vec3(0.5, 0.5, 0.5)},
                                         {"center", Vec3(0.5, 0.5, 0.5)},
                                         {"inside", true},
                                         {"restitution", 1.0}});
  struct Frame {
    int steps;
    Vec3 x;
  };
  const Frame frames[] = {{50, {0.7, 0.05, 0.575}}, {100, {0.8, 0.4, 0.75}},
                          {200, {0.2, 0.9, 0.9}},   {500, {0.8, 0.8, 0.15}},
                          {1000, {0.2, 0.7, 0.1}},  {10000, {0.2, 0.3, 0.6}}};
  for (const char* method : {"rk4", "verlet"})
    for (const Frame& frame : frames) {
      sim::Simulation ball(make_particle({0.2, 0.3, 0.4}, {1, -0.7, 0.35}, room, false), registry,
                           {.integrator = {method}, .dt = 0.01});
      REQUIRE(run(ball, frame.steps));
      CHECK((ball.position(0) - frame.x).norm() < 1e-11);
      CHECK(ball.velocity(0).norm() == Approx(Vec3(1, -0.7, 0.35).norm()).epsilon(1e-12));
    }
}

TEST_CASE("a table carries what lies on it, and throws it") {
  sim::Registry registry = make_registry();
  // Sideways with friction: carried while the acceleration is below mu g.
  for (const char* method : {"rk4", "verlet"}) {
    INFO(method);
    sim::PartSpec shaken = make_slope(0, 0.9);
    shaken.given["motion"] =
        make_motion(registry, "swing", {{"amplitude", Vec3(0.2, 0, 0)}, {"period", 1.0}});
    sim::Simulation carried(make_particle({0.1, 0, 0}, {1.2566370614359172, 0, 0}, shaken),
                            registry, {.integrator = {method}, .dt = 1e-3});
    REQUIRE(run(carried, 1100));
    const double u = 2 * 3.141592653589793 * 1.1;
    CHECK(carried.position(0).x() == Approx(0.1 + 0.2 * std::sin(u)).margin(1e-9));
    CHECK(carried.position(0).y() == 0);

    // Upwards: it leaves where the acceleration of the table is -g, and flies.
    sim::PartSpec lifted = make_slope(0, 0);
    lifted.given["motion"] =
        make_motion(registry, "swing", {{"amplitude", Vec3(0, 0.5, 0)}, {"period", 1.0}});
    const double omega = 2 * 3.141592653589793;
    const double leaves = std::asin(kGravity / (0.5 * omega * omega)) / omega;
    const auto height = [&](double h) {
      sim::Simulation thrown(make_particle({0, 0, 0}, {0, 0.5 * omega, 0}, lifted), registry,
                             {.integrator = {method}, .dt = h});
      REQUIRE(run(thrown, std::lround(0.3 / h)));
      return thrown.position(0).y();
    };
    const double after = 0.3 - leaves;
    const double exact = 0.5 * std::sin(omega * leaves) +
                         0.5 * omega * std::cos(omega * leaves) * after -
                         0.5 * kGravity * after * after;
    const double coarse = std::abs(height(0.01) - exact), fine = std::abs(height(0.000625) - exact);
    INFO(coarse << " " << fine);
    CHECK(fine < 1e-6);
    CHECK(std::log2(coarse / fine) / 4 > 1.7);
  }
}

TEST_CASE("beads on a cylinder hold what Euler and Eytelwein say, and slip beyond it") {
  sim::Registry registry = make_registry();
  // The largest tension is T_low q^n, q = (cos d/2 + mu sin d/2) / (cos d/2 - mu sin d/2): 10 beads
  // 0.1 rad apart, mu = 0.3. The string is a chain of stiff springs, pulled by weights along its
  // ends.
  const int beads = 10;
  const double limit = 1.350227112330833;
  for (const double share : {0.97, 1.03}) {
    sim::SystemSpec spec = make_falling(1, 0);
    spec.particles->list.clear();
    spec.forces.clear();
    sim::PartSpec springs = make_part("spring", {{"stiffness", 2000.0}});
    const double first = -0.05 * (beads - 1) - 0.1;
    for (int i = 0; i < beads + 2; ++i) {
      const double angle = first + 0.1 * i;
      const Vec3 on(std::sin(angle), std::cos(angle), 0);
      Vec3 place = on;
      if (i == 0 || i == beads + 1) {
        const double edge = i == 0 ? first + 0.1 : first + 0.1 * beads;
        const Vec3 at(std::sin(edge), std::cos(edge), 0), along(std::cos(edge), -std::sin(edge), 0);
        // Half of the angle between beads goes on at each end.
        const double half = 0.05;
        const Vec3 away = std::cos(half) * along - std::sin(half) * at;
        place = at + (i == 0 ? Vec3(-(std::cos(half) * along + std::sin(half) * at)) : away) * 0.1;
      }
      spec.particles->list.push_back({.position = place, .mass = 0.01});
      if (i > 0) springs.elements.add({i - 1, i});
    }
    spec.forces.push_back(springs);
    spec.forces.push_back(make_drag(0.05));
    spec.loads.assign(static_cast<std::size_t>(beads + 2), Vec3::Zero());
    const auto pull = [&](std::size_t end, std::size_t bead, double tension) {
      spec.loads[end] =
          tension *
          (spec.particles->list[end].position - spec.particles->list[bead].position).normalized();
    };
    pull(0, 1, 1);
    pull(static_cast<std::size_t>(beads + 1), static_cast<std::size_t>(beads), share * limit);
    spec.colliders = {make_part(
        "capsule",
        {{"a", Vec3(0, 0, -1)}, {"b", Vec3(0, 0, 1)}, {"radius", 1.0}, {"friction", 0.3}})};
    sim::Simulation capstan(spec, registry, {.integrator = {"verlet"}, .dt = 5e-4});
    REQUIRE(run(capstan, 6000));
    const Vec3 before = capstan.position(5);
    REQUIRE(run(capstan, 2000));
    const double moved = (capstan.position(5) - before).norm();
    INFO(share << " moved " << moved);
    CHECK((share < 1 ? moved < 1e-6 : moved > 1e-3));
  }
}

TEST_CASE("particles that are squeezed are named, and the step is not taken") {
  sim::Registry registry = make_registry();
  for (const char* method :
       {"rk4", "verlet", "pefrl", "dopri5", "bs23", "tsit5", "dop853", "rkf45", "esdirk43"})
    for (const auto accuracy : {sim::Accuracy::kSettle, sim::Accuracy::kProject}) {
      INFO(method << ", " << static_cast<int>(accuracy));
      sim::SystemSpec spec = make_particle({5, 5, 5}, {0, 0, 0},
                                           make_part("plane", {{"normal", Vec3(0, 1, 0)}}), false);
      spec.accuracy = accuracy;
      spec.particles->list.push_back({.position = {0, 0.02, 0}, .mass = 1});
      spec.colliders.push_back(make_part(
          "plane", {{"normal", Vec3(0, -1, 0)},
                    {"point", Vec3(0, 6, 0)},
                    {"motion", make_motion(registry, "line", {{"velocity", Vec3(0, -10, 0)}})}}));
      sim::Simulation press(spec, registry, {.integrator = {method}, .dt = 0.01});
      int steps = 0;
      while (press.step()) REQUIRE(++steps < 70);
      CHECK(steps > 55);
      CHECK(press.divergence().status == sim::StepStatus::kNotAllowed);
      CHECK(press.divergence().why.find("particle 0") != std::string::npos);
      CHECK(press.step_count() == steps);
      CHECK_FALSE(press.step());
    }
}

// The box passes the floor within one step of a method with steps of its own.
TEST_CASE("a box that crushes a particle on a floor is refused when it does, not before") {
  sim::Registry registry = make_registry();
  const std::map<std::string, sim::Value> fall{{"velocity", Vec3(0, -0.5, 0)}};
  for (const char* method : {"verlet", "rk4", "dopri5", "bs23", "tsit5", "dop853", "esdirk43"}) {
    INFO(method);
    sim::SystemSpec spec =
        make_particle({0, 0, 0}, {0, 0, 0}, make_part("plane", {{"friction", 0.3}}));
    spec.colliders.push_back(make_part("box", {{"half", Vec3(1, 0.1, 1)},
                                               {"center", Vec3(0, 0.5, 0)},
                                               {"motion", make_motion(registry, "line", fall)}}));
    sim::Simulation crushed(spec, registry, {.integrator = {method}, .dt = 0.005});
    while (crushed.step()) {
      REQUIRE(crushed.step_count() < 165);
      CHECK(std::abs(crushed.position(0).y()) < 1e-9);
    }
    CHECK(crushed.step_count() >= 158);
    CHECK(crushed.divergence().why.find("particle 0 is squeezed") != std::string::npos);
  }
}

TEST_CASE("a cloth on a sphere is never inside, loses energy, and comes to rest") {
  sim::Registry registry = make_registry();
  sim::SystemSpec spec = make_cloth(12, {.pinned = false});
  spec.colliders = {make_part("sphere", {{"radius", 0.25},
                                         {"center", Vec3(0.47, -0.3, 0.47)},
                                         {"friction", 0.5},
                                         {"thickness", 0.01}})};
  for (const char* method : {"rk4", "verlet"}) {
    sim::Simulation cloth(spec, registry, {.integrator = {method}, .dt = 5e-4});
    sim::study::EnergyBalance balance(cloth);
    double deepest = 0, fastest = 0;
    for (int n = 0; n < 3000; ++n) {
      REQUIRE(cloth.step());
      balance.advance();
      balance.look();
      for (int i = 0; i < cloth.particles(); ++i)
        deepest = std::max(deepest, 0.26 - (cloth.position(i) - Vec3(0.47, -0.3, 0.47)).norm());
    }
    for (int i = 0; i < cloth.particles(); ++i)
      fastest = std::max(fastest, cloth.velocity(i).norm());
    INFO(method << " deepest " << deepest << " fastest " << fastest << " error " << balance.error()
                << " J of " << balance.in_play());
    CHECK(deepest < 1e-12);
    CHECK(std::abs(balance.error()) < 1e-3 * balance.in_play());
    CHECK(balance.contact().lost > 0);
    CHECK(balance.contact().given == 0);
  }
}
