// Wind on triangles and particles, and the breeze in it.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>

#include "core/base/layout.h"
#include "core/geometry/triangle_mesh.h"
#include "core/particles/particle_system.h"
#include "core/scene/simulation.h"
#include "core/study/problem.h"
#include "plugins/forces/wind/air.h"
#include "plugins/forces/wind/wind_forces.h"
#include "tests/lua/scene_text.h"
#include "tests/support/scenes.h"

using namespace sim;
using namespace sim::test;

namespace {

const std::array<Vec3, 3> kAtRest = {Vec3(0, 0, 0), Vec3(0, 0, 0), Vec3(0, 0, 0)};

std::string vector_text(const Vec3& v) {
  char text[120];
  std::snprintf(text, sizeof text, "{%.17g, %.17g, %.17g}", v[0], v[1], v[2]);
  return text;
}

// One triangle of particles of 0.1 kg in a wind with these options.
std::string triangle(const std::array<Vec3, 3>& x, const std::array<Vec3, 3>& v,
                     const std::string& options, const std::string& others = "") {
  std::string text = "local p = sim.particles { mass = 0.1 }\n";
  for (std::size_t i = 0; i < 3; ++i)
    text += "p:add(" + vector_text(x[i]) + ", { velocity = " + vector_text(v[i]) + " })\n";
  return text +
         "local skin = sim.surface { particles = p, triangles = { {0, 1, 2} } }\n"
         "return sim.scene { particles = p, forces = { " +
         others + "sim.force.wind { surface = skin, " + options +
         " } }, integrator = 'rk4', dt = 0.001, duration = 1 }";
}

Simulation compiled(const std::string& text, int threads = 1) {
  Registry registry({SIM_PLUGIN_DIR});
  return Simulation(load_text(text).systems[0], registry, {.threads = threads});
}

std::string law(const char* name, double cn, double ct) {
  return std::string("law = '") + name + "', cn = " + std::to_string(cn) +
         ", ct = " + std::to_string(ct) + ", density = 1.225";
}

}  // namespace

// Evaluated from the law in 40 digits.
TEST_CASE("the force of the wind on a triangle", "[wind]") {
  struct Case {
    std::array<Vec3, 3> x, v;
    Vec3 wind, normal_and_across, normal_alone, linear;  // N, on each corner
  };
  const Case cases[] = {
      {{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 0, 1)},
       {Vec3(0, -3, 0), Vec3(0, -3, 0), Vec3(0, -3, 0)},
       Vec3(0, 0, 0),
       Vec3(0, 1.1025, 0),
       Vec3(0, 1.8375000000000001, 0),
       Vec3(0, 0.25, 0)},
      {{Vec3(-0.352, -0.698, 0.302), Vec3(-0.855, 0.072, -0.269), Vec3(-0.884, 0.015, -0.925)},
       {Vec3(-0.398, -2.581, -2.456), Vec3(-0.453, 1.961, -2.257), Vec3(-1.661, 0.765, 2.686)},
       Vec3(0.925, -1.24, 5.715),
       Vec3(0.07086540572075402, -0.05824071825757289, 0.2752010072970502),
       Vec3(0.0133603555946889, 0.00778782347917178, -0.0012673113575591003),
       Vec3(0.023238510661918364, 0.0014964107871240332, 0.03191989344222105)},
      {{Vec3(-0.271, -0.559, -0.546), Vec3(-0.607, -0.591, 0.248), Vec3(0.801, 0.681, -0.041)},
       {Vec3(0.918, 1.798, -2.491), Vec3(0.964, 2.459, 1.694), Vec3(1.501, -0.132, -1.929)},
       Vec3(3.47, -2.01, 3.61),
       Vec3(3.115741708976625, -3.229383869673656, 1.3759438641270891),
       Vec3(5.286569297176498, -5.392900805304214, 2.019791508918852),
       Vec3(1.231990677475577 / 3, -1.2936003970005958 / 3, 0.6047544999165753 / 3)}};
  const auto check = [](const Case& each, const std::string& options, const Vec3& expected,
                        double accuracy) {
    const std::string velocity = ", velocity = " + vector_text(each.wind);
    const Simulation simulation = compiled(triangle(each.x, each.v, options + velocity));
    for (int i = 0; i < 3; ++i) {
      const auto shares = simulation.forces_on(i);
      REQUIRE(shares.size() == 1);
      CHECK((shares[0].force - expected).norm() <= accuracy * expected.norm());
    }
  };
  for (const Case& each : cases) {
    check(each, law("quadratic", 1.2, 0.1), each.normal_and_across, 1e-13);
    check(each, law("quadratic", 2.0, 0.0), each.normal_alone, 1e-13);
    check(each, law("linear", 0.5, 0.05), each.linear, 1e-13);
  }

  // No area, no force.
  const Simulation line = compiled(triangle({Vec3(0, 0, 0), Vec3(1e-200, 0, 0), Vec3(0, 1e-200, 0)},
                                            kAtRest, "velocity = {1, 2, 3}"));
  CHECK(line.forces_on(0)[0].force.norm() == 0);
}

// m v' = -m g + rho/2 A cn v^2 from rest: v = -V tanh(g t / V), y = -V^2/g ln cosh(g t / V) with
// V^2 = 2 m g / (rho A cn).
TEST_CASE("a sheet falls flat at its terminal speed", "[wind]") {
  const std::string scene =
      triangle({Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 0, 1)}, kAtRest,
               law("quadratic", 1.2, 0.1) + ", velocity = {0, 0, 0}", "sim.force.gravity {}, ");
  for (const auto& [method, accuracy] : {std::pair{"rk4", 1e-11}, {"verlet", 2e-7}}) {
    INFO(method);
    Registry registry({SIM_PLUGIN_DIR});
    Simulation simulation(load_text(scene).systems[0], registry, {.integrator = {method}});
    REQUIRE(sim_test::run(simulation, 1000));
    CHECK(simulation.position(1).y() == Approx(-2.264830843493449).epsilon(accuracy));
    CHECK(simulation.velocity(2).y() == Approx(-2.8243575555275244).epsilon(accuracy));
  }
}

TEST_CASE("a breeze has the mean, the strength and the scales that were asked for", "[wind]") {
  const Air air(Vec3(1, -2, 0.5), {.strength = 0.6, .tau = 0.4, .length = 0.3, .seed = 7});
  const Vec3 place(0.31, -1.7, 0.22);
  Vec3 sum = Vec3::Zero(), squares = Vec3::Zero(), together = Vec3::Zero(), apart = Vec3::Zero();
  double most = 0;
  constexpr int kTimes = 400'000;
  for (int k = 0; k < kTimes; ++k) {
    const AirNow now = air.at(0.05 * k);
    const Vec3 w = now.velocity(place) - Vec3(1, -2, 0.5);
    const Vec3 near = now.velocity(place + Vec3(0.003, 0, 0)) - Vec3(1, -2, 0.5);
    const Vec3 far = now.velocity(place + Vec3(4, 3, -5)) - Vec3(1, -2, 0.5);
    sum += w;
    for (int axis = 0; axis < 3; ++axis) {
      squares[axis] += w[axis] * w[axis];
      together[axis] += w[axis] * near[axis];
      apart[axis] += w[axis] * far[axis];
    }
    most = std::max(most, w.norm());
  }
  for (int axis = 0; axis < 3; ++axis) {
    CHECK(std::fabs(sum[axis]) / kTimes < 0.01 * 0.6);
    CHECK(std::sqrt(squares[axis] / kTimes) == Approx(0.6).epsilon(0.01));
    CHECK(together[axis] / squares[axis] > 0.99);
    CHECK(std::fabs(apart[axis]) / squares[axis] < 0.05);
  }
  CHECK(most < 0.6 * 3 * 3);
  CHECK(most > 0.6 * 3);
}

TEST_CASE("a breeze has no divergence, and knows its slope", "[wind]") {
  const Air air(Vec3(1, 0, 0), {.strength = 2, .tau = 0.4, .length = 0.7, .seed = 3});
  const AirNow now = air.at(12.34);
  for (int k = 0; k < 20; ++k) {
    const Vec3 x(0.37 * k - 2, 1.1 * k, -0.2 * k * k);
    Mat3 slope = Mat3::Zero();
    now.velocity(x, &slope);
    CHECK(std::fabs(slope(0, 0) + slope(1, 1) + slope(2, 2)) < 1e-13);
    for (int axis = 0; axis < 3; ++axis) {
      Vec3 d = Vec3::Zero();
      d[axis] = 1e-5;
      const Vec3 difference = (now.velocity(x + d) - now.velocity(x - d)) / 2e-5;
      for (int row = 0; row < 3; ++row)
        CHECK(difference[row] == Approx(slope(row, axis)).margin(1e-7));
    }
  }
}

// The same air by the vector code on triangles, in runs and loose, and by the scalar code. A
// triangle with 1 m^2 on each of ten places, at rest, with the linear law: F = cn w on it.
TEST_CASE("triangles in runs and loose ones feel the same air", "[wind]") {
  const std::string options =
      "law = 'linear', cn = 1, ct = 1, velocity = {0.3, 0.2, 0.1}, breeze = 1.5, tau = 0.5, "
      "length = 2, seed = 5";
  const Air air(Vec3(0.3, 0.2, 0.1), {.strength = 1.5, .tau = 0.5, .length = 2, .seed = 5});
  std::string grid = "local g = sim.grid { 9, 12, du = {0, 0, 1}, dv = {1, 0, 0}, mass = 1 }\n";
  const std::string rest =
      "return sim.scene { particles = g, forces = { sim.force.wind { surface "
      "= skin, " +
      options + " } }, integrator = 'rk4', dt = 0.001, duration = 1 }";
  const Simulation runs = compiled(grid + "local skin = sim.surface { grid = g }\n" + rest, 2);
  std::vector<Vec3> expected(9 * 12, Vec3::Zero());
  const auto triangles = grid_triangles({9, 12, 1}, false);
  std::string list = "local skin = sim.surface { particles = g, triangles = {";
  for (const auto& ids : triangles) {
    Vec3 middle = Vec3::Zero();
    for (const int i : ids) middle += (1.0 / 3) * runs.position(i);
    for (const int i : ids)
      expected[static_cast<std::size_t>(i)] += 0.5 / 3 * air.at(0).velocity(middle);
    if (&ids - triangles.data() < 5)
      list += "{" + std::to_string(ids[0]) + "," + std::to_string(ids[1]) + "," +
              std::to_string(ids[2]) + "}, ";
  }
  for (int i = 0; i < 9 * 12; ++i)
    CHECK((runs.forces_on(i)[0].force - expected[static_cast<std::size_t>(i)]).norm() < 1e-14);

  // The first five triangles alone fit no run.
  std::ranges::fill(expected, Vec3::Zero());
  for (std::size_t t = 0; t < 5; ++t) {
    Vec3 middle = Vec3::Zero();
    for (const int i : triangles[t]) middle += (1.0 / 3) * runs.position(i);
    for (const int i : triangles[t])
      expected[static_cast<std::size_t>(i)] += 0.5 / 3 * air.at(0).velocity(middle);
  }
  const Simulation loose = compiled(grid + list + "} }\n" + rest);
  for (int i = 0; i < 9 * 12; ++i)
    CHECK((loose.forces_on(i)[0].force - expected[static_cast<std::size_t>(i)]).norm() < 1e-14);
}

// A sheet of 13 x 23 particles at random, from several particles on and in several tiles.
TEST_CASE("wind that is swept gives what wind that is gathered gives", "[wind]") {
  constexpr int kRows = 13, kColumns = 23, kParticles = kRows * kColumns;
  const TriangleMesh sheet(kParticles, grid_triangles({kRows, kColumns, 1}, false));
  const Air air(Vec3(1, 0.5, 0), {.strength = 0.7, .tau = 0.5, .length = 0.3, .seed = 2});
  WindForces forces({false, 0.7, 0.1}, air, sheet);
  const Layout layout(kParticles);
  Array state(layout.size());
  for (int i = 0; i < kParticles; ++i)
    for (int block = 0; block < 6; ++block)
      layout.block(state.data(), block)[i] = 0.1 * (block == 0   ? i / kColumns
                                                    : block == 1 ? i % kColumns
                                                                 : 0) +
                                             0.03 * std::sin(17.0 * i + 5 * block);
  const auto q = layout.axes<const double>(state.data()),
             v = layout.axes<const double>(state.data(), 3);
  const ParticleView view{kParticles, 0.3, q[0], q[1], q[2], v[0], v[1], v[2]};
  const auto sums = [&](const auto& add) {
    std::vector<double> sum(3 * kParticles);
    add(ForceSink{sum.data(), sum.data() + kParticles, sum.data() + 2 * kParticles});
    return sum;
  };
  ThreadPool pool(3);
  forces.prepare(view, pool);
  const std::vector<double> gathered = sums([&](ForceSink sink) {
    forces.add({0, kParticles}, sink);
  });
  const auto sweep = forces.sweep();
  REQUIRE(sweep);
  CHECK(sweep->reach() == kColumns + 1);
  for (const int from : {0, 8, 176})
    for (const int tile : {8, 72, 512}) {
      const std::vector<double> swept = sums([&](ForceSink sink) {
        sweep->start(view, from);
        for (int begin = from; begin < kParticles; begin += tile)
          sweep->add(view, {begin, std::min(begin + tile, kParticles)}, sink);
      });
      INFO("from " << from << " in tiles of " << tile);
      for (std::size_t i = 0; i < swept.size(); ++i)
        REQUIRE(swept[i] == (static_cast<int>(i) % kParticles < from ? 0 : gathered[i]));
    }
}

// A force that gives nothing, and cannot be swept, has all of them gathered.
TEST_CASE("a cloth in the wind takes the same steps swept and gathered", "[wind]") {
  const auto hash_of = [](const std::string& method, const std::string& others, int threads) {
    const std::string text =
        "local g = sim.grid { 96, 90, du = {0, 0, 0.01}, dv = {0.01, 0, 0}, mass = 1e-4 }\n"
        "g:pin(0)\n"
        "local k = sim.force.spring { stiffness = 20, grid = g, offsets = { {0, 1}, {1, 0} } }\n"
        "return sim.scene { particles = g, forces = { k, sim.force.wind { surface = sim.surface { "
        "grid = g }, velocity = {1, 3, 0}, breeze = 1 }" +
        others + " }, integrator = '" + method + "', dt = 5e-4, duration = 1 }";
    Simulation simulation = compiled(text, threads);
    REQUIRE(sim_test::run(simulation, 12));
    return simulation.hash();
  };
  for (const std::string method : {"rk4", "verlet", "bs23"}) {
    INFO(method);
    const auto swept = hash_of(method, "", 1);
    CHECK(swept == hash_of(method, ", sim.force.wind { area = 0 }", 1));
    for (const int threads : {2, 3}) CHECK(swept == hash_of(method, "", threads));
  }
}

TEST_CASE("wind on particles is a drag towards the air", "[wind]") {
  const std::string scene =
      "local p = sim.particles { mass = 0.1 }\np:add {0, 0, 0}\n"
      "return sim.scene { particles = p, forces = { sim.force.gravity {}, sim.force.wind { area = "
      "0.05, law = 'linear', cn = 1, velocity = {3, 0, 1} } }, integrator = 'rk4', dt = 0.005, "
      "duration = 1 }";
  Simulation simulation = compiled(scene);
  REQUIRE(sim_test::run(simulation, 200));
  // m v' = -m g + c (u - v) from rest.
  CHECK(simulation.position(0).x() == Approx(0.6391839582758005).epsilon(1e-9));
  CHECK(simulation.position(0).y() == Approx(-4.180263087123736).epsilon(1e-9));
  CHECK(simulation.velocity(0).z() == Approx(0.3934693402873666).epsilon(1e-9));
}

namespace {

// The blocks of a force, and the pairs of particles that have one.
struct Blocks final : JacobianSink {
  std::map<std::array<int, 2>, std::array<Mat3, 2>> of;  // by position, by velocity
  void position(int i, int j, const Mat3& block) override { of[{i, j}][0] += block; }
  void velocity(int i, int j, const Mat3& block) override { of[{i, j}][1] += block; }
};

}  // namespace

// m v' = c (u - v) by implicit Euler: v + h c / m (v - u) is what it was, and one linear step
// finds it, however the linear equations are solved.
TEST_CASE("a linear wind is one linear step of an implicit method", "[wind]") {
  Registry registry({SIM_PLUGIN_DIR});
  for (const std::string solver : {"auto", "cg", "ldlt"})
    for (const bool tied : {false, true}) {
      std::string scene =
          "local p = sim.particles { mass = 0.1 }\np:add {0, 0, 0}\np:add {1, 0, 0}\n";
      if (tied) scene += "local s = sim.force.spring { stiffness = 30 }\ns:tie(0, 1)\n";
      scene += std::string("return sim.scene { particles = p, forces = { ") + (tied ? "s, " : "") +
               "sim.force.wind { area = 5, law = 'linear', cn = 1, velocity = {3, 0, 1} } },\n"
               "  integrator = 'implicit_euler', dt = 0.1, duration = 1 }";
      MethodChoice method{"implicit_euler"};
      method.given["newton_steps"] = std::int64_t{1};
      method.given["solver"] = solver;
      Simulation simulation(load_text(scene).systems[0], registry, {.integrator = method});
      INFO(solver << ", " << tied);
      Vec3 v(0, 0, 0);
      for (int n = 0; n < 5; ++n) {
        REQUIRE(simulation.step());
        constexpr double kShare = 0.1 * 5 / 0.1;
        v = (v + kShare * Vec3(3, 0, 1)) / (1 + kShare);
        for (int i = 0; i < 2; ++i) CHECK((simulation.velocity(i) - v).norm() < 1e-8);
      }
    }
}

// f(x + e) - f(x - e) over 2 e, with e = 1e-5 m or m/s.
TEST_CASE("derivatives of the wind are those of its force, and couplings name their pairs",
          "[wind]") {
  const std::string air = "velocity = {3, 0.5, 1}, breeze = 1, tau = 0.4, length = 0.5 }";
  for (const std::string law : {"linear", "quadratic"})
    for (const bool surface : {false, true}) {
      std::string text =
          "local p = sim.particles { mass = 0.1 }\n"
          "p:add {0, 0, 0}\np:add {1, 0, 0.2}\np:add {0.1, 0.4, 1}\np:add {1.1, 0.3, 1}\n";
      text += surface ? "local on = { surface = sim.surface { particles = p, triangles = "
                        "{ {0, 1, 2}, {1, 3, 2} } }, cn = 1.5, ct = 0.2, "
                      : "local on = { area = 0.05, cn = 1.5, ";
      if (!surface || law == "quadratic") text += "law = '" + law + "', ";
      text += air +
              "\nreturn sim.scene { particles = p, forces = { sim.force.wind(on) }, "
              "integrator = 'rk4', dt = 0.01, duration = 1 }";
      INFO(text);
      Simulation system = compiled(text);
      REQUIRE(study::particles_of(system)->forces().size() == 1);
      Force& force = *study::particles_of(system)->forces()[0];
      double numbers[6][4], mass[4] = {0.1, 0.1, 0.1, 0.1};
      for (int i = 0; i < 4; ++i)
        for (int k = 0; k < 6; ++k)
          numbers[k][i] = k < 3 ? system.position(i)[k] : 0.7 * std::sin(1 + 2 * k + 5 * i);
      ParticleView view{.n = 4, .t = 0.3, .x = numbers[0], .y = numbers[1], .z = numbers[2]};
      view.vx = numbers[3], view.vy = numbers[4], view.vz = numbers[5], view.mass = mass;
      ThreadPool pool(1);
      const auto forces = [&] {
        std::array<std::array<double, 4>, 3> sum{};
        force.prepare(view, pool);
        force.accumulate(view, {0, 4}, {sum[0].data(), sum[1].data(), sum[2].data()});
        return sum;
      };
      Blocks blocks;
      force.prepare(view, pool);
      REQUIRE(force.has_jacobian());
      force.jacobian(view, blocks);
      for (int j = 0; j < 4; ++j)
        for (int k = 0; k < 6; ++k) {
          constexpr double kAway = 1e-5;
          const double before = numbers[k][j];
          numbers[k][j] = before + kAway;
          const auto above = forces();
          numbers[k][j] = before - kAway;
          const auto below = forces();
          numbers[k][j] = before;
          for (int i = 0; i < 4; ++i)
            for (std::size_t axis = 0; axis < 3; ++axis) {
              const auto at = static_cast<std::size_t>(i);
              CHECK(blocks.of[{i, j}][k < 3 ? 0 : 1](static_cast<int>(axis), k % 3) ==
                    Approx((above[axis][at] - below[axis][at]) / (2 * kAway)).margin(1e-6));
            }
        }
      std::vector<std::array<int, 2>> pairs;
      REQUIRE(force.couplings(pairs));
      for (const auto& [ids, block] : blocks.of) {
        if (ids[0] >= ids[1] || (block[0] == Mat3() && block[1] == Mat3())) continue;
        INFO(ids[0] << ", " << ids[1]);
        CHECK(std::ranges::count_if(pairs, [&, ends = ids](const std::array<int, 2>& pair) {
                return std::minmax(pair[0], pair[1]) == std::minmax(ends[0], ends[1]);
              }) > 0);
      }
    }
}

// Simulations with half the step differ by 16 times less.
TEST_CASE("rk4 keeps its order in a breeze", "[wind]") {
  const std::string scene =
      "local p = sim.particles { mass = 0.1 }\np:add {0, 0, 0}\n"
      "return sim.scene { particles = p, forces = { sim.force.wind { area = 0.3, breeze = 2, tau = "
      "0.4, length = 0.5 } }, integrator = 'rk4', dt = 0.02, duration = 2 }";
  std::vector<Vec3> ends;
  for (const double dt : {0.02, 0.01, 0.005}) {
    Registry registry({SIM_PLUGIN_DIR});
    Simulation simulation(load_text(scene).systems[0], registry, {.dt = dt});
    REQUIRE(sim_test::run(simulation, static_cast<int>(std::lround(2 / dt))));
    ends.push_back(simulation.position(0));
  }
  const double order = std::log2((ends[0] - ends[1]).norm() / (ends[1] - ends[2]).norm());
  CHECK(order > 3.7);
  CHECK(order < 5.5);
}

TEST_CASE("wind says what is wrong with it", "[wind]") {
  const auto error_of = [](const std::string& options) {
    try {
      compiled(
          "local p = sim.particles {}\np:add {0, 0, 0}\nreturn sim.scene { particles = p, "
          "forces = { sim.force.wind { " +
          options + " } }, integrator = 'rk4', dt = 0.01, duration = 1 }");
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  CHECK(contains(error_of(""), "it blows on nothing"));
  CHECK(contains(error_of("area = -1"), "area"));
  CHECK(contains(error_of("area = 1, tau = 0"), "tau"));
  CHECK(contains(error_of("area = 1, density = -1"), "density"));
  CHECK(contains(error_of("area = 1, surface = 3"), "surface"));
}
