// Forces of a fluid against sums over all pairs and images, and what they must not depend on.
#include "plugins/forces/fluid/fluid_forces.h"

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

// The view that a force has of some moving points.
struct Moving {
  explicit Moving(const Points& points, const Points& speeds = {}) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      q[a].assign(points.size() + 16, 0);
      v[a].assign(points.size() + 16, 0);
      for (std::size_t i = 0; i < points.size(); ++i) {
        q[a][i] = points[i][a];
        if (!speeds.empty()) v[a][i] = speeds[i][a];
      }
    }
    mass.assign(points.size() + 16, 1);
    view.n = static_cast<int>(points.size());
    view.x = q[0].data(), view.y = q[1].data(), view.z = q[2].data();
    view.vx = v[0].data(), view.vy = v[1].data(), view.vz = v[2].data();
    view.mass = mass.data();
  }
  Moving(const Moving&) = delete;
  Moving& operator=(const Moving&) = delete;

  std::vector<double> q[3], v[3], mass;
  ParticleView view;
};

double dice(int i) {
  return 2 * std::fmod(std::fabs(std::sin(12.9898 * i + 4.1) * 43758.5453), 1) - 1;
}

// A lattice that is a little too dense, shaken; its first point is at `first`.
Points lump(const std::array<int, 3>& size, double spacing, double shake, const Vec3& first = {}) {
  Points points;
  for (int i = 0; i < size[0]; ++i)
    for (int j = 0; j < size[1]; ++j)
      for (int k = 0; k < size[2]; ++k) {
        const int c = 3 * static_cast<int>(points.size());
        points.push_back(first + spacing * Vec3(i, j, k) +
                         shake * Vec3(dice(c), dice(c + 1), dice(c + 2)));
      }
  return points;
}

enum class What { kPressure, kViscosity };

std::vector<double> forces_of(FluidForces& fluid, const Moving& state, What part = What::kPressure,
                              int threads = 1) {
  ThreadPool pool(threads);
  fluid.prepare(state.view, pool);
  const auto n = static_cast<std::size_t>(state.view.n);
  std::vector<double> f(3 * n);
  const ForceSink sink{f.data(), f.data() + n, f.data() + 2 * n};
  for (int begin = 0; begin < state.view.n; begin += 7) {
    const Tile tile{begin, std::min(begin + 7, state.view.n)};
    part == What::kPressure ? fluid.add_pressure(tile, sink) : fluid.add_viscosity(tile, sink);
  }
  return f;
}

double energy_of(FluidForces& fluid, const Moving& state) {
  ThreadPool pool(1);
  fluid.prepare(state.view, pool);
  return fluid.potential({0, state.view.n});
}

// Each particle has 1 kg: with this density neighbours at rest are 1 m apart.
FluidForces make_fluid(int dimensions = 3, double viscosity = 0, double tension = 0) {
  return FluidForces({1, 1.3, 10, viscosity, 0, tension}, dimensions, {});
}

std::unique_ptr<Collider> make_collider(Registry& registry, const std::string& name,
                                        const std::map<std::string, Value>& given) {
  const auto& plugin = registry.get<Collider>(name);
  return plugin.make(Params(plugin.title(), plugin.params, given, {}));
}

double largest_of(const std::vector<double>& list) {
  double most = 0;
  for (const double number : list) most = std::max(most, std::fabs(number));
  return most;
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0;
  for (std::size_t k = 0; k < a.size(); ++k) most = std::max(most, std::fabs(a[k] - b[k]));
  return most;
}

long double wendland(long double r) {  // h = 1.3, not normalised
  const long double q = r / 1.3L, u = 1 - q / 2;
  return q < 2 ? u * u * u * u * (2 * q + 1) : 0;
}

}  // namespace

TEST_CASE("the density of a lattice is that of Wendland's kernel") {
  // The sum of m W/rho over a cubic lattice of m = rho dx^d, W = C f(r/h)/h^d with C = 21/(16 pi)
  // in space and 7/(4 pi) in the plane: sums in 40 digits.
  struct Known {
    int dimensions;
    double smoothing, density;
  };
  for (const Known& known : {Known{2, 1.2, 1.0179517432723388},
                             {2, 1.3, 1.010473152107087},
                             {2, 2, 1.0012057963402388},
                             {3, 1.0, 1.0338430086773107},
                             {3, 1.3, 1.0095007837847996},
                             {3, 2, 1.0005486164045416}}) {
    const double factor = known.dimensions == 3
                              ? 21 / (16 * 3.14159265358979323846) / std::pow(known.smoothing, 3)
                              : 7 / (4 * 3.14159265358979323846) / std::pow(known.smoothing, 2);
    FluidLaw law{.dimensions = known.dimensions, .volume = 1, .smoothing = known.smoothing};
    fit_to_lattice(law);
    CHECK(factor / law.scale == Approx(known.density).epsilon(1e-12));
  }
}

TEST_CASE("densities and forces of a fluid are those of sums over all pairs") {
  const Points points = lump({5, 6, 4}, 0.9, 0.2);
  const std::size_t n = points.size();
  const Moving state(points);
  FluidForces fluid = make_fluid();
  fluid.bind(state.view);
  const std::vector<double> found = forces_of(fluid, state);
  const auto scale = static_cast<long double>(fluid.law().scale);
  std::vector<long double> density(n, scale);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j)
      if (i != j) density[i] += scale * wendland((points[i] - points[j]).norm());
  long double energy = 0, stiffness = 100.0L / 7;
  std::vector<long double> slope(n, 0);
  for (std::size_t i = 0; i < n; ++i) {
    CHECK(fluid.density(static_cast<int>(i)) ==
          Approx(static_cast<double>(density[i])).epsilon(1e-13));
    if (density[i] <= 1) continue;
    slope[i] = stiffness * (std::pow(density[i], 5) - 1 / (density[i] * density[i]));
    energy += stiffness * ((std::pow(density[i], 6) - 1) / 6 + 1 / density[i] - 1);
  }
  CHECK(energy > 100);
  CHECK(energy_of(fluid, state) == Approx(static_cast<double>(energy)).epsilon(1e-12));
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      long double sum = 0;
      for (std::size_t j = 0; j < n; ++j) {
        const Vec3 d = points[i] - points[j];
        const long double q = d.norm() / 1.3L, u = 1 - q / 2;
        if (i != j && q < 2)
          sum += (slope[i] + slope[j]) * scale * 5 / (1.3L * 1.3L) * u * u * u * d[axis];
      }
      CHECK(found[axis * n + i] ==
            Approx(static_cast<double>(sum)).margin(1e-11 * largest_of(found)));
    }
}

TEST_CASE("the forces of a fluid are the slopes of its energy, walls and all, and sum to nothing") {
  Registry registry = sim_test::make_registry();
  for (const int with : {0, 1, 2, 10, 12}) {
    const int walls = with % 10;
    FluidForces fluid = make_fluid(3, 0, with < 10 ? 0 : 20);
    // A room, whose walls meet in a corner; beside a ball on its floor.
    if (walls > 0)
      fluid.add_wall(make_collider(
          registry, "box", {{"half", Vec3(2, 2, 2)}, {"center", Vec3(2, 2, 2)}, {"inside", true}}));
    if (walls > 1)
      fluid.add_wall(
          make_collider(registry, "sphere", {{"radius", 0.7}, {"center", Vec3(2, 0, 2)}}));
    Points points = lump({5, 5, 5}, 0.85, 0.15, Vec3(0.3, 0.3, 0.3));
    if (walls > 1)
      std::erase_if(points, [](const Vec3& p) { return (p - Vec3(2, 0, 2)).norm() < 0.71; });
    const std::size_t n = points.size();
    const Moving state(points);
    fluid.bind(state.view);
    const std::vector<double> f = forces_of(fluid, state);
    const double size = largest_of(f);
    REQUIRE(size > 1);
    double sum[3] = {};
    for (std::size_t k = 0; k < f.size(); ++k) sum[k / n] += f[k];
    if (walls == 0)
      for (const double total : sum)
        CHECK(std::fabs(total) < 1e-12 * size * static_cast<double>(n));
    for (std::size_t i = 0; i < n; i += 3)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        constexpr double kStep = 1e-5;
        Points low = points, high = points;
        low[i][axis] -= kStep;
        high[i][axis] += kStep;
        const double slope =
            (energy_of(fluid, Moving(high)) - energy_of(fluid, Moving(low))) / (2 * kStep);
        INFO(with << " walls, particle " << i << " axis " << axis);
        CHECK(f[axis * n + i] == Approx(-slope).margin(1e-7 * size));
      }
  }
}

TEST_CASE("behind walls at right angles a fluid goes on as its mirror image") {
  Registry registry = sim_test::make_registry();
  const Points points = lump({4, 5, 4}, 0.9, 0.2, Vec3(0.4, 0.4, 0.4));
  const std::size_t n = points.size();
  for (int walls = 1; walls <= 3; ++walls) {
    FluidForces held = make_fluid(), whole = make_fluid();
    Points all = points;
    for (int axis = 0; axis < walls; ++axis) {
      Vec3 normal;
      normal[static_cast<std::size_t>(axis)] = 1;
      held.add_wall(make_collider(registry, "plane", {{"normal", normal}}));
      const std::size_t before = all.size();
      for (std::size_t i = 0; i < before; ++i) {
        Vec3 image = all[i];
        image[static_cast<std::size_t>(axis)] = -0.5 - image[static_cast<std::size_t>(axis)];
        all.push_back(image);
      }
    }
    const Moving few(points), many(all);
    held.bind(few.view);
    whole.bind(many.view);
    const std::vector<double> f = forces_of(held, few), of_all = forces_of(whole, many);
    REQUIRE(largest_of(f) > 1);
    for (std::size_t i = 0; i < n; ++i) {
      CHECK(held.density(static_cast<int>(i)) ==
            Approx(whole.density(static_cast<int>(i))).epsilon(1e-13));
      for (std::size_t axis = 0; axis < 3; ++axis)
        CHECK(f[axis * n + i] ==
              Approx(of_all[axis * all.size() + i]).margin(1e-12 * largest_of(f)));
    }
  }
}

namespace {

// A collider that does not say what it is.
class Untold final : public Collider {
 public:
  explicit Untold(std::unique_ptr<Collider> other) : other_(std::move(other)) {}
  ContactMaterial material() const override { return other_->material(); }
  SurfaceSample query(double t, const Vec3& x) const override { return other_->query(t, x); }
  bool moves() const override { return false; }

 private:
  std::unique_ptr<Collider> other_;
};

}  // namespace

TEST_CASE("walls that are planes push as those do that are asked point by point") {
  Registry registry = sim_test::make_registry();
  const Points points = lump({7, 5, 6}, 0.9, 0.2, Vec3(0.5, 0.5, 0.5));
  const Moving state(points);
  FluidForces fluid = make_fluid(), asked = make_fluid();
  for (const Vec3& normal : {Vec3(1, 0, 0), Vec3(0, 3, 1), Vec3(0, -1, 3)}) {
    fluid.add_wall(make_collider(registry, "plane", {{"normal", normal}}));
    asked.add_wall(
        std::make_unique<Untold>(make_collider(registry, "plane", {{"normal", normal}})));
  }
  fluid.bind(state.view);
  asked.bind(state.view);
  const std::vector<double> f = forces_of(fluid, state), expected = forces_of(asked, state);
  REQUIRE(largest_of(f) > 1);
  CHECK(largest_difference(f, expected) < 1e-12 * largest_of(f));
  CHECK(energy_of(fluid, state) == Approx(energy_of(asked, state)).epsilon(1e-13));
}

TEST_CASE("viscosity keeps momentum and turning momentum, brakes, and has the strength it says") {
  const Points points = lump({6, 5, 4}, 0.9, 0.2);
  const std::size_t n = points.size();
  Points speeds;
  for (std::size_t i = 0; i < n; ++i) {
    const int c = 3 * static_cast<int>(i) + 1000;
    speeds.push_back({dice(c), dice(c + 1), dice(c + 2)});
  }
  FluidForces fluid = make_fluid(3, 0.7);
  const Moving state(points, speeds);
  fluid.bind(state.view);
  const std::vector<double> f = forces_of(fluid, state, What::kViscosity);
  Vec3 force, torque;
  double power = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 own(f[i], f[n + i], f[2 * n + i]);
    force += own;
    torque += points[i].cross(own);
    power += own.dot(speeds[i]);
  }
  CHECK(force.norm() < 1e-12 * largest_of(f) * static_cast<double>(n));
  CHECK(torque.norm() < 1e-11 * largest_of(f) * static_cast<double>(n));
  CHECK(power < -0.1 * largest_of(f));

  // mu V v'' in the middle of a lattice where a shear v = (e.x)^2 g, e and g at right angles: exact
  // in the mean over the directions in the plane, and not far off in each.
  for (const int dimensions : {2, 3}) {
    const Points lattice = lump({13, 13, dimensions == 3 ? 13 : 1}, 1, 0);
    const std::size_t middle = lattice.size() / 2;
    double mean = 0;
    constexpr int kDirections = 8;
    for (int k = 0; k < kDirections; ++k) {
      const double angle = 3.14159265358979323846 * k / kDirections;
      const Vec3 e(std::cos(angle), std::sin(angle), 0), g(-e[1], e[0], 0);
      Points shear;
      for (const Vec3& p : lattice) shear.push_back(std::pow(e.dot(p - lattice[middle]), 2) * g);
      FluidForces slow = make_fluid(dimensions, 0.5);
      const Moving flow(lattice, shear);
      slow.bind(flow.view);
      const std::vector<double> drag = forces_of(slow, flow, What::kViscosity);
      const Vec3 f_middle(drag[middle], drag[lattice.size() + middle],
                          drag[2 * lattice.size() + middle]);
      CHECK(f_middle.dot(g) == Approx(0.5 * 2).epsilon(0.2));
      mean += f_middle.dot(g) / kDirections;
    }
    CHECK(mean == Approx(0.5 * 2).epsilon(dimensions == 2 ? 1e-12 : 0.03));
  }
}

TEST_CASE("forces of a fluid have the same bits for threads, instruction sets and ages of lists") {
  Registry registry = sim_test::make_registry();
  const auto make = [&] {
    FluidForces fluid = make_fluid(3, 0.3);
    fluid.add_wall(make_collider(
        registry, "box",
        {{"half", Vec3(9, 9, 9)}, {"center", Vec3(8.5, 8.5, 8.5)}, {"inside", true}}));
    return fluid;
  };
  const Points start = lump({9, 9, 9}, 0.9, 0.1), speeds = lump({9, 9, 9}, 0.1, 1);
  FluidForces walked = make();
  walked.bind(Moving(start, speeds).view);
  for (const double displacement : {0.02, 0.1, 0.14, 0.2, 0.9}) {
    Points points = start;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const int c = static_cast<int>(7 * i);
      points[i] += displacement * Vec3(dice(c), dice(c + 1), dice(c + 2)) +
                   displacement * Vec3(0.4, 0.4, 0.4);
    }
    const Moving state(points, speeds);
    for (const What part : {What::kPressure, What::kViscosity}) {
      FluidForces fresh = make();
      fresh.bind(Moving(start, speeds).view);
      const std::vector<double> expected = forces_of(fresh, state, part);
      REQUIRE(largest_of(expected) > 0.1);
      CHECK(same_bits(forces_of(walked, state, part), expected));
      CHECK(energy_of(walked, state) == energy_of(fresh, state));
      for (const int threads : {2, 3, 4}) {
        FluidForces shared = make();
        shared.bind(Moving(start, speeds).view);
        CHECK(same_bits(forces_of(shared, state, part, threads), expected));
      }
      for (const char* level : {"sse2", "fma", "avx2", "avx512"}) {
        setenv("SIM_SIMD", level, 1);
        FluidForces other = make();
        unsetenv("SIM_SIMD");
        other.bind(Moving(start, speeds).view);
        CHECK(same_bits(forces_of(other, state, part), expected));
      }
    }
  }
}

TEST_CASE("a fluid of some particles leaves the others alone") {
  Points points = lump({5, 5, 5}, 0.9, 0.1);
  const Points own = points;
  std::vector<int> ids;
  for (std::size_t i = 0; i < own.size(); ++i) {
    points.insert(points.begin() + static_cast<std::ptrdiff_t>(2 * i), Vec3(1.1, 2.2, 3.3));
    ids.push_back(static_cast<int>(2 * i + 1));
  }
  FluidForces some({1, 1.3, 10, 0.2, 0}, 3, ids), all = make_fluid(3, 0.2);
  const Moving among(points, points), alone(own, own);
  some.bind(among.view);
  all.bind(alone.view);
  for (const What part : {What::kPressure, What::kViscosity}) {
    const std::vector<double> f = forces_of(some, among, part),
                              expected = forces_of(all, alone, part);
    std::vector<double> picked(expected.size());
    double others = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::size_t i = 0; i < own.size(); ++i) {
        picked[axis * own.size() + i] = f[axis * points.size() + 2 * i + 1];
        others += std::fabs(f[axis * points.size() + 2 * i]);
      }
    CHECK(same_bits(picked, expected));
    CHECK(others == 0);
  }
  CHECK(energy_of(some, among) == energy_of(all, alone));
  CHECK(largest_difference({some.density(0)}, {0}) == 0);
}

TEST_CASE("fluids that cannot be are refused with what to do") {
  const auto refusal = [](const FluidDensity& given, const Points& points) -> std::string {
    FluidForces fluid(given, 3, {});
    try {
      fluid.bind(Moving(points).view);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  using Catch::Contains;
  const Points points = lump({5, 5, 5}, 0.9, 0.1);
  CHECK(refusal({1, 0, 0, 0, 0}, points).empty());
  CHECK_THAT(refusal({0.1, 0, 0, 0, 0}, points), Contains("times as dense") && Contains("mass"));
  CHECK_THAT(refusal({1, 0.3, 0, 0, 0}, points), Contains("smoothing") && Contains("1.5 m"));
}
