// Forces of pair potentials against sums over all pairs, and what they must not depend on.
#include "plugins/forces/pair/pair_forces.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>

#include "core/base/error.h"
#include "tests/support/scenes.h"

using namespace sim;
using sim_test::same_bits;

namespace {

using Points = std::vector<Vec3>;

// The view that a force has of some points, and the forces it gives.
struct State {
  explicit State(const Points& points) {
    for (int axis = 0; axis < 3; ++axis) {
      q[axis].assign(points.size() + 16, 0);
      for (std::size_t i = 0; i < points.size(); ++i) q[axis][i] = points[i][axis];
    }
    mass.assign(points.size() + 16, 1);
    view.n = static_cast<int>(points.size());
    view.x = q[0].data(), view.y = q[1].data(), view.z = q[2].data();
    view.mass = mass.data();
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  std::vector<double> q[3], mass;
  ParticleView view;
};

std::vector<double> forces_at(PairForces& forces, const Points& points, int threads = 1) {
  const State state(points);
  ThreadPool pool(threads);
  forces.prepare(state.view, pool);
  std::vector<double> f(3 * points.size());
  const std::size_t n = points.size();
  forces.add({0, state.view.n}, {f.data(), f.data() + n, f.data() + 2 * n});
  return f;
}

double energy_at(PairForces& forces, const Points& points) {
  const State state(points);
  ThreadPool pool(1);
  forces.prepare(state.view, pool);
  return forces.potential({0, state.view.n});
}

// Numbers in [-1, 1) that look random.
double noise(int i) {
  return 2 * std::fmod(std::fabs(std::sin(12.9898 * i + 4.1) * 43758.5453), 1) - 1;
}

// A lattice of side^3 points that are moved by up to `shake` along each axis.
Points lattice(int side, double spacing, double shake) {
  Points points;
  for (int i = 0; i < side * side * side; ++i)
    points.push_back(spacing * Vec3(i / side / side, i / side % side, i % side) +
                     shake * Vec3(noise(3 * i), noise(3 * i + 1), noise(3 * i + 2)));
  return points;
}

// States of all kinds: dense; two clusters of 300 m and far outliers; one plane; a line; two.
std::vector<Points> states() {
  Points outliers = lattice(4, 1.1, 0.1);
  for (const Vec3& p : lattice(4, 1.1, 0.1)) outliers.push_back(p + Vec3(300, -20, 7));
  for (const Vec3& p : {Vec3(1e6, 2e6, -1e6), Vec3(1e6 + 1.1, 2e6, -1e6), Vec3(-1e300, 0, 0),
                        Vec3(-1e300, 1, 0), Vec3(0, 1e15, 1e15)})
    outliers.push_back(p);
  Points plane, line;
  for (int i = 0; i < 200; ++i) plane.push_back({1.2 * (i % 14), 5, -1.2 * (i / 14)});
  for (int i = 0; i < 50; ++i) line.push_back({0, 1.3 * i, 0});
  return {lattice(9, 1.1, 0.1), outliers, plane, line, {{0, 0, 0}, {1.2, 0, 0}}};
}

std::vector<PairLaw> laws() {
  using Kind = PairLaw::Kind;
  const PairLaw jones{Kind::kLennardJones, 0.7, 1.05, 0, 2.5};
  const PairLaw morse{Kind::kMorse, 2, 1.3, 1.7, 3.1};
  return {jones, shifted(jones, false), shifted(jones, true), {Kind::kSoft, 40, 1.5, 0, 1.5},
          morse, shifted(morse, true)};
}

// U and U' in long double.
std::pair<long double, long double> exact(const PairLaw& law, long double r) {
  const auto plain = [&](long double at) -> std::pair<long double, long double> {
    const long double k = law.strength, length = law.length, a = law.rate;
    if (law.kind == PairLaw::Kind::kSoft)
      return {k / 2 * (length - at) * (length - at), -k * (length - at)};
    if (law.kind == PairLaw::Kind::kMorse) {
      const long double e = std::exp(-a * (at - length));
      return {k * (e * e - 2 * e), -2 * a * k * (e * e - e)};
    }
    const long double s = std::pow(length / at, 6.0L);
    return {4 * k * (s * s - s), -24 * k * (2 * s * s - s) / at};
  };
  if (r >= law.cutoff) return {0, 0};
  auto [u, slope] = plain(r);
  const auto [u_end, slope_end] = plain(law.cutoff);
  if (law.energy_shift != 0) u -= u_end;
  if (law.slope_shift != 0) u -= slope_end * (r - law.cutoff), slope -= slope_end;
  return {u, slope};
}

// The largest difference from the sums over all pairs, in long double, relative to the sums of
// sizes.
double worst_force(const PairLaw& law, const Points& points, const std::vector<double>& found) {
  const std::size_t n = points.size();
  double worst = 0;
  for (std::size_t i = 0; i < n; ++i) {
    long double sum[3] = {}, sizes = 1e-12L;
    for (std::size_t j = 0; j < n; ++j) {
      if (i == j) continue;
      long double d[3], rr = 0;
      for (int axis = 0; axis < 3; ++axis) {
        d[axis] = static_cast<long double>(points[i][axis]) - points[j][axis];
        rr += d[axis] * d[axis];
      }
      const long double r = std::sqrt(rr), slope = exact(law, r).second;
      for (int axis = 0; axis < 3; ++axis) sum[axis] -= slope * d[axis] / r;
      sizes += std::fabs(slope);
    }
    for (std::size_t axis = 0; axis < 3; ++axis)
      worst =
          std::max(worst, static_cast<double>(std::fabs(found[axis * n + i] - sum[axis]) / sizes));
  }
  return worst;
}

std::string error_of(const std::map<std::string, Value>& given) {
  Registry registry = sim_test::make_registry();
  SystemSpec spec = sim_test::make_falling(1, 0);
  spec.forces = {sim_test::make_part("pair", given)};
  try {
    const Simulation simulation(spec, registry);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

// side^3 particles of 1 kg that move.
SystemSpec make_gas(int side, const std::map<std::string, Value>& given) {
  SystemSpec spec = sim_test::make_falling(1, 0);
  spec.particles->list.clear();
  int i = 0;
  for (const Vec3& p : lattice(side, 1.2, 0.02)) {
    i += 3;
    spec.particles->list.push_back({p, 1.5 * Vec3(noise(-i), noise(-i - 1), noise(-i - 2)), 1.0});
  }
  spec.forces = {sim_test::make_part("pair", given)};
  spec.dt = 0.005;
  return spec;
}

}  // namespace

TEST_CASE("forces and energies of pairs are those of a sum over all pairs", "[particles]") {
  for (const PairLaw& law : laws())
    for (const Points& points : states()) {
      PairForces forces(law, 0.3);
      INFO("law " << static_cast<int>(law.kind) << ", " << points.size() << " particles");
      CHECK(worst_force(law, points, forces_at(forces, points)) <= 1e-14);
      long double energy = 0, sizes = 1e-12L;
      for (std::size_t i = 0; i < points.size(); ++i)
        for (std::size_t j = 0; j < i; ++j) {
          const long double u = exact(law, (points[i] - points[j]).stableNorm()).first;
          energy += u;
          sizes += std::fabs(u);
        }
      CHECK(std::fabs(energy_at(forces, points) - energy) <= 1e-13L * sizes);
    }
}

TEST_CASE("the force of a pair is the slope of its energy, and opposite for the two") {
  for (const PairLaw& law : laws()) {
    PairForces forces(law, 0.3);
    const Points points = lattice(3, 1.1, 0.1);
    const std::vector<double> f = forces_at(forces, points);
    double size = 0, total[3] = {};
    for (std::size_t k = 0; k < f.size(); ++k) {
      size = std::max(size, std::fabs(f[k]));
      total[k / points.size()] += f[k];
    }
    REQUIRE(size > 0.1);
    for (const double sum : total) CHECK(std::fabs(sum) <= 1e-12 * size);
    // No pair may cross a cutoff where U jumps.
    if (law.kind != PairLaw::Kind::kSoft && law.energy_shift == 0) continue;
    for (std::size_t i = 0; i < points.size(); i += 5)
      for (int axis = 0; axis < 3; ++axis) {
        constexpr double kStep = 1e-5;
        Points low = points, high = points;
        low[i][axis] -= kStep;
        high[i][axis] += kStep;
        const double slope = (energy_at(forces, high) - energy_at(forces, low)) / (2 * kStep);
        CHECK(f[static_cast<std::size_t>(axis) * points.size() + i] ==
              Approx(-slope).margin(2e-6 * size));
      }
  }
}

TEST_CASE("forces of pairs have the same bits for threads, instruction sets and ages of lists") {
  const Points start = lattice(9, 1.1, 0.1);
  for (const PairLaw& law : laws()) {
    PairForces walked(law, 0.3);
    forces_at(walked, start);
    // A walk within the skin, then further; one particle is shot through all cells meanwhile.
    for (const double way : {0.02, 0.1, 0.14, 0.2, 0.9, 0.95}) {
      Points points = start;
      for (std::size_t i = 0; i < points.size(); ++i)
        points[i] += way * Vec3(noise(static_cast<int>(7 * i)), noise(static_cast<int>(7 * i + 1)),
                                noise(static_cast<int>(7 * i + 2)));
      if (way > 0.5) points[17] = Vec3(40 * way, 30 * way, -200 * way);
      PairForces fresh(law, 0.3), wide(law, 1.1);
      const std::vector<double> expected = forces_at(fresh, points);
      CHECK(same_bits(forces_at(walked, points), expected));
      CHECK(same_bits(forces_at(wide, points), expected));
      const double energy = energy_at(fresh, points);
      CHECK(energy_at(walked, points) == energy);
      if (way != 0.1 && way != 0.9) continue;
      for (const int threads : {2, 3, 4}) {
        PairForces shared(law, 0.3);
        CHECK(same_bits(forces_at(shared, points, threads), expected));
      }
      for (const char* level : {"sse2", "fma", "avx2", "avx512"}) {
        setenv("SIM_SIMD", level, 1);
        PairForces other(law, 0.3);
        unsetenv("SIM_SIMD");
        CHECK(same_bits(forces_at(other, points), expected));
        CHECK(energy_at(other, points) == energy);
      }
    }
    CHECK(walked.neighbours().builds() >= 3);
    CHECK(walked.neighbours().builds() <= 6);
  }
}

TEST_CASE("lists of neighbours have every pair within the cutoff once, by ascending id") {
  for (const Points& points : states()) {
    const State state(points);
    Neighbours neighbours(1.5, 0.4);
    ThreadPool pool(2);
    REQUIRE(neighbours.update(state.view, pool));
    CHECK_FALSE(neighbours.update(state.view, pool));
    std::size_t missing = 0, entries = 0;
    for (int i = 0; i < state.view.n; ++i) {
      std::vector<int> list;
      neighbours.for_each(i, [&](int j) { list.push_back(j); });
      CHECK(std::adjacent_find(list.begin(), list.end(), std::greater_equal<>()) == list.end());
      entries += list.size();
      for (int j = 0; j < state.view.n; ++j)
        missing += j != i && (state.view.position(i) - state.view.position(j)).stableNorm() < 1.5 &&
                   !std::binary_search(list.begin(), list.end(), j);
    }
    CHECK(missing == 0);
    CHECK(neighbours.entries() == static_cast<std::int64_t>(entries));
  }
}

TEST_CASE("particles at one place exert no force on each other, and bad positions harm nobody") {
  const double inf = HUGE_VAL, nan = std::nan("");
  for (const PairLaw& law : laws()) {
    PairForces forces(law, 0.3);
    const Points pair = {{1, 2, 3}, {1, 2, 3}};
    CHECK(forces_at(forces, pair) == std::vector<double>(6, 0.0));
    CHECK(std::isfinite(energy_at(forces, pair)));
    if (law.kind == PairLaw::Kind::kSoft) CHECK(energy_at(forces, pair) == 45);
    const Points good = {{0, 0, 0}, {1.2, 0, 0}};
    PairForces others(law, 0.3);
    const std::vector<double> f =
        forces_at(others, {good[0], good[1], {nan, 0, 0}, {inf, 0, 0}, {0, -inf, nan}});
    CHECK(f[0] == forces_at(forces, good)[0]);
    CHECK(f[1] == -f[0]);
    CHECK(f[0] != 0);
  }
}

TEST_CASE("a pair in the potential of Lennard-Jones swings with the period of the integral") {
  // From rest at the outer turning point b; T = 2 int_a^b dr / sqrt(2 (U(b) - U(r)) / m),
  // m = 1/2; with r = (a + b)/2 + (b - a)/2 sin s the integrand is smooth and periodic in s.
  const PairLaw law{PairLaw::Kind::kLennardJones, 1, 1, 0, 2.5};
  const long double b = 1.4L, energy = exact(law, b).first;
  long double a = 0.9L, top = 1.1L;
  for (int k = 0; k < 100; ++k)
    (exact(law, (a + top) / 2).first > energy ? a : top) = (a + top) / 2;
  const long double pi = std::acos(-1.0L);
  long double period = 0;
  constexpr int kTerms = 200;
  for (int k = 0; k < kTerms; ++k) {
    const long double s = pi * (k + 0.5L) / kTerms - pi / 2, half = (b - a) / 2;
    const long double r = (a + b) / 2 + half * std::sin(s);
    period += 2 * half * std::cos(s) / std::sqrt(4 * (energy - exact(law, r).first)) * pi / kTerms;
  }

  Registry registry = sim_test::make_registry();
  SystemSpec spec = sim_test::make_falling(1, 0);
  spec.particles->list = {{{0, 0, 0}, {0, 0, 0}, 1.0}, {{1.4, 0, 0}, {0, 0, 0}, 1.0}};
  spec.forces = {sim_test::make_part("pair", {{"smooth", std::string("off")}})};
  spec.dt = static_cast<double>(period) / 4000;
  Simulation simulation(spec, registry, {.integrator = "rk4"});
  REQUIRE(sim_test::run(simulation, 8000));
  CHECK(simulation.position(1)[0] - simulation.position(0)[0] == Approx(1.4).margin(1e-8));
  CHECK(std::fabs(simulation.velocity(1)[0]) < 1e-6);
  REQUIRE(sim_test::run(simulation, 2000));
  CHECK(simulation.position(1)[0] - simulation.position(0)[0] < static_cast<double>(a) + 1e-7);
}

TEST_CASE("a gas keeps its energy and momentum, and goes on from a snapshot with the same bits") {
  Registry registry = sim_test::make_registry();
  const SystemSpec spec = make_gas(5, {{"smooth", std::string("force")}});
  Simulation gas(spec, registry, {.integrator = "verlet"});
  const double start = gas.energy().total(), size = gas.energy().kinetic;
  REQUIRE(sim_test::run(gas, 100));
  const Snapshot snapshot = gas.snapshot();
  double worst = 0;
  for (int k = 0; k < 40; ++k) {
    REQUIRE(sim_test::run(gas, 10));
    worst = std::max(worst, std::fabs(gas.energy().total() - start) / size);
  }
  CHECK(worst < 2e-3);
  Vec3 momentum = Vec3::Zero(), before = Vec3::Zero();
  for (int i = 0; i < gas.particles(); ++i) {
    momentum += gas.velocity(i);
    before += spec.particles->list[static_cast<std::size_t>(i)].velocity;
  }
  CHECK((momentum - before).norm() <= 1e-12 * size);

  Simulation other(spec, registry, {.integrator = "verlet", .threads = 3});
  other.restore(snapshot);
  REQUIRE(sim_test::run(other, 400));
  CHECK(other.hash() == gas.hash());
}

TEST_CASE("implicit methods take a gas with the blocks of its pairs") {
  Registry registry = sim_test::make_registry();
  const SystemSpec spec = make_gas(10, {{"smooth", std::string("force")}});
  Simulation implicit(spec, registry, {.integrator = "implicit_midpoint"});
  Simulation fine(spec, registry, {.integrator = "rk4"});
  REQUIRE(sim_test::run(implicit, 5));
  REQUIRE(sim_test::run(fine, 5));
  double worst = 0;
  for (int i = 0; i < fine.particles(); ++i)
    worst = std::max(worst, (implicit.position(i) - fine.position(i)).norm());
  CHECK(worst < 1e-4);
  CHECK(worst > 0);
}

TEST_CASE("pinned particles push others and stay") {
  Registry registry = sim_test::make_registry();
  SystemSpec spec = make_gas(2, {});
  spec.particles->pinned = {0, 1, 2, 3, 4, 5, 6};
  for (int i = 0; i < 7; ++i)
    spec.particles->list[static_cast<std::size_t>(i)].velocity = Vec3::Zero();
  Simulation simulation(spec, registry, {.integrator = "verlet"});
  const Vec3 start = simulation.position(3), speed = simulation.velocity(7);
  REQUIRE(sim_test::run(simulation, 10));
  CHECK(simulation.position(3) == start);
  CHECK(simulation.velocity(7) != speed);
}

TEST_CASE("a pair force refuses what does not fit its potential") {
  using Catch::Contains;
  const std::string soft = "soft", morse = "morse";
  CHECK(error_of({}).empty());
  CHECK(error_of({{"potential", soft}, {"k", 3.0}, {"radius", 2.0}, {"skin", 0.0}}).empty());
  CHECK_THAT(error_of({{"potential", soft}, {"sigma", 1.0}}), Contains("'soft' takes no sigma"));
  CHECK_THAT(error_of({{"potential", soft}, {"cutoff", 1.0}}), Contains("ends at its radius"));
  CHECK_THAT(error_of({{"potential", morse}, {"k", 1.0}}), Contains("'morse' takes no k"));
  CHECK_THAT(error_of({{"depth", 1.0}}), Contains("'lennard_jones' takes no depth"));
  CHECK_THAT(error_of({{"sigma", 0.0}}), Contains("sigma is 0") && Contains("positive"));
  CHECK_THAT(error_of({{"sigma", -1.0}}), Contains("at least 0"));
  CHECK_THAT(error_of({{"potential", std::string("coulomb")}}), Contains("lennard_jones"));
}

// All parameters of the three potentials: which each takes, what it says of the others, and of 0.
TEST_CASE("each pair law takes its own parameters, not those of the others, and not 0") {
  const std::map<std::string, std::vector<std::string>> own{
      {"lennard_jones", {"epsilon", "sigma", "cutoff", "smooth"}},
      {"soft", {"k", "radius"}},
      {"morse", {"depth", "r0", "a", "cutoff", "smooth"}}};
  for (const auto& [law, takes] : own)
    for (const char* const name :
         {"epsilon", "sigma", "k", "radius", "depth", "r0", "a", "cutoff", "smooth"}) {
      const auto with = [&](double value) {
        std::map<std::string, Value> given{{"potential", law}, {name, value}};
        if (std::string(name) == "smooth") given[name] = std::string("off");
        return error_of(given);
      };
      const bool cuts = std::string(name) == "cutoff" || std::string(name) == "smooth";
      INFO(law << ", " << name);
      if (std::ranges::count(takes, name) == 0) {
        CHECK(with(2) == "force 'pair': potential '" + law + "' takes no " + name + "; leave " +
                             name + " out" +
                             (cuts ? ": " + law + " ends at its radius"
                                   : ", or choose the potential it belongs to"));
      } else {
        CHECK(with(2) == "");
        if (std::string(name) != "smooth")
          CHECK(with(0) == "force 'pair': " + std::string(name) + " is 0; give a positive number");
      }
    }
}

TEST_CASE("lists that do not fit into memory are an error before the first step") {
  const Points points(33000, Vec3(1, 2, 3));
  const State state(points);
  Neighbours neighbours(1, 0.3);
  ThreadPool pool(1);
  CHECK_THROWS_WITH(neighbours.update(state.view, pool),
                    Catch::Contains("GiB") && Catch::Contains("smaller cutoff"));
  CHECK_THROWS_AS(neighbours.update(state.view, pool), Error);
}
