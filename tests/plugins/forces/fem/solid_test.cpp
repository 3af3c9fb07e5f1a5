// Elastic solids by finite elements: against closed forms, beam theory and values made elsewhere.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/geometry/cells.h"
#include "core/math/logarithm.h"
#include "core/ode/jacobian.h"
#include "plugins/forces/fem/constitutive_law.h"
#include "plugins/forces/fem/fem_forces.h"
#include "tests/support/scenes.h"

using namespace sim_test;

namespace {

using Size = std::array<int, 3>;
const char* const kModels[] = {"neo_hookean", "corotated", "stvk"};

struct Body {
  Size size{3, 3, 3};  // particles
  sim::Vec3 step{0.5, 0.5, 0.5};
  int order = 1;
  std::string model = "neo_hookean";
  double young = 5.2, poisson = 0.3, density = 8;
};

// A free block with the corner 0 at the origin, its first direction along x.
sim::SystemSpec make_body(const Body& body) {
  sim::SystemSpec spec;
  spec.name = "body";
  spec.integrator = "euler";
  spec.dt = 1;
  spec.particles.emplace();
  sim::GridSpec& grid = spec.particles->grid.emplace();
  grid.size = body.size;
  grid.directions = 3;
  grid.du = {body.step[0], 0, 0};
  grid.dv = {0, body.step[1], 0};
  grid.dw = {0, 0, body.step[2]};
  sim::PartSpec part = make_part("solid", {{"young", body.young},
                                           {"poisson", body.poisson},
                                           {"density", body.density},
                                           {"model", body.model}});
  part.elements.cells = true;
  part.elements.arity = body.order == 1 ? 4 : 10;
  part.elements.ids = sim::grid_cells(body.size, body.order);
  spec.forces = {part};
  sim::weigh_cells(spec);
  return spec;
}

void deform(sim::Simulation& system, const sim::Mat3& F) {
  for (int i = 0; i < system.particles(); ++i) system.set_position(i, F * system.position(i));
}

// The force on each particle: the change of its momentum in a step of 1 s from rest.
std::vector<sim::Vec3> forces_on(sim::Simulation& system, const sim::SystemSpec& spec) {
  std::vector<sim::Vec3> before, forces;
  for (int i = 0; i < system.particles(); ++i) before.push_back(system.velocity(i));
  REQUIRE(system.step());
  for (int i = 0; i < system.particles(); ++i)
    forces.push_back(spec.particles->at(i).mass / system.h() *
                     (system.velocity(i) - before[static_cast<std::size_t>(i)]));
  return forces;
}

double largest_of(const std::vector<sim::Vec3>& list) {
  double most = 0;
  for (const sim::Vec3& v : list) most = std::max(most, v.cwiseAbs().maxCoeff());
  return most;
}

const sim::Mat3 kGeneral({1.1, 0.2, -0.1}, {0.05, 0.9, 0.3}, {-0.2, 0.1, 1.2});

bool is_inside(const Size& size, int i) {
  const int at[3] = {i / size[2] / size[1], i / size[2] % size[1], i % size[2]};
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (at[axis] == 0 || at[axis] == size[axis] - 1) return false;
  return true;
}

// Young's modulus and Poisson's ratio of Lame's constants.
std::pair<double, double> moduli(double mu, double lambda) {
  return {mu * (3 * lambda + 2 * mu) / (lambda + mu), lambda / (2 * (lambda + mu))};
}

// A block of springs' ends: all particles with i = 0 are pinned.
void hold_left(sim::SystemSpec& spec) {
  const Size& size = spec.particles->grid->size;
  for (int i = 0; i < size[1] * size[2]; ++i) spec.particles->pinned.push_back(i);
}

}  // namespace

namespace {

// The energy of cells of 1 m^3 that are deformed alike, a cell.
double energy_density(const sim::ConstitutiveLaw& law, const sim::Mat3& F) {
  constexpr int kCells = 11, kNodes = 4 * kCells;  // not a whole number of vectors
  const double side = std::cbrt(6.0);
  std::vector<double> x(kNodes), y(kNodes), z(kNodes), still(kNodes);
  std::vector<int> ids;
  const sim::ParticleView view{.n = kNodes,
                               .x = x.data(),
                               .y = y.data(),
                               .z = z.data(),
                               .vx = still.data(),
                               .vy = still.data(),
                               .vz = still.data()};
  const auto place = [&](const sim::Mat3& by) {
    for (std::size_t i = 0; i < kNodes; ++i) {
      sim::Vec3 corner;
      if (i % 4 > 0) corner[i % 4 - 1] = side;
      const sim::Vec3 at = by * corner;
      x[i] = at[0], y[i] = at[1], z[i] = at[2];
    }
  };
  for (int i = 0; i < kNodes; ++i) ids.push_back(i);
  sim::FemForces cells(law, ids, 4);
  place(sim::Mat3::Identity());
  cells.bind(view);
  place(F);
  sim::ThreadPool pool(1);
  cells.prepare(view, pool);
  return cells.potential({0, kNodes}) / kCells;
}

}  // namespace

// Values of mpmath with 50 digits, mu = 2 Pa and lambda = 3 Pa, as they stand in psi.
TEST_CASE("energy densities of deformations have the values computed elsewhere") {
  struct Case {
    sim::Mat3 F;
    double stvk, corotated, neo_hookean;
  };
  const double rest = -1.0112943611198906;  // of neo_hookean, whose energy begins elsewhere there
  const Case cases[] = {
      {sim::Mat3::Diagonal({1.5, 0.9, 0.8}), 1.04785, 0.66, -0.5829625087160129},
      {{{1, 0.4, 0}, {0, 1, 0}, {0, 0, 1}}, 0.1824, 0.16392194562886067, -0.8905150742731719},
      {kGeneral, 0.65628671875, 0.5131919317767056, -0.6596703345342688},
      {{{0.3, 0, 0}, {0, 0.4, 0.1}, {0, 0, 0.5}},
       3.3672875,
       7.027983982853726,
       0.20829034917316705},
      {{{-0.5, 0, 0}, {0, 1, 0.1}, {0, 0.2, 1}}, 0.55585, 7.95377262797386, 4.046227531527565},
      {sim::Mat3::Diagonal({1, 1, 0}), 0.875, 3.5, 1.2763877113318902}};
  using Model = sim::ConstitutiveLaw::Model;
  for (const Case& c : cases) {
    CHECK(energy_density({Model::kStVk, 2, 3}, c.F) == Approx(c.stvk).epsilon(1e-13));
    CHECK(energy_density({Model::kCorotated, 2, 3}, c.F) == Approx(c.corotated).epsilon(1e-13));
    CHECK(energy_density({Model::kNeoHookean, 2, 3}, c.F) ==
          Approx(c.neo_hookean - rest).epsilon(1e-13));
  }
  for (const double x : {1e-300, 0.3, 0.70710678118654746, 1.0, 1.5, 7.0, 1e300})
    CHECK(sim::logarithm(x) == Approx(std::log(x)).epsilon(1e-15).margin(1e-18));
}

// A unit cube of 2 x 2 x 2 cells, mu = 2 Pa, lambda = 3 Pa, under kGeneral; mpmath, 50 digits: the
// force on the corner at the origin of a cube of one cell.
TEST_CASE("nodal forces of a deformed cube are those computed elsewhere") {
  sim::Registry registry = make_registry();
  const auto [young, poisson] = moduli(2, 3);
  const struct {
    const char* model;
    sim::Vec3 first, second;
  } cases[] = {{"stvk",
                {0.5356666666666666, 0.8132291666666667, 0.828875},
                {0.6652708333333334, -0.21844791666666666, -0.9248125}},
               {"corotated",
                {0.37444104573747206, 0.531997256774314, 0.486744334658551},
                {0.44705029194227797, -0.1881500190971, -0.4870663095853985}}};
  for (const auto& c : cases) {
    const sim::SystemSpec spec = make_body({.size = {2, 2, 2},
                                            .step = {1, 1, 1},
                                            .model = c.model,
                                            .young = young,
                                            .poisson = poisson});
    sim::Simulation cube(spec, registry);
    deform(cube, kGeneral);
    const std::vector<sim::Vec3> forces = forces_on(cube, spec);
    INFO(c.model);
    CHECK((forces[0] - c.first).cwiseAbs().maxCoeff() < 1e-13);
    CHECK((forces[1] - c.second).cwiseAbs().maxCoeff() < 1e-13);
  }
}

TEST_CASE("patch test: a homogeneous deformation leaves the inside of a solid without force") {
  sim::Registry registry = make_registry();
  for (const int order : {1, 2})
    for (const char* model : kModels) {
      const Size size = {5, 5, 5};
      const sim::SystemSpec spec =
          make_body({.size = size, .step = {0.3, 0.2, 0.4}, .order = order, .model = model});
      sim::Simulation body(spec, registry);
      deform(body, kGeneral);
      const std::vector<sim::Vec3> forces = forces_on(body, spec);
      const double most = largest_of(forces);
      sim::Vec3 sum, torque;
      INFO(model << ", order " << order);
      CHECK(most > 0.05);
      for (int i = 0; i < 125; ++i) {
        const sim::Vec3& force = forces[static_cast<std::size_t>(i)];
        if (is_inside(size, i)) CHECK(force.cwiseAbs().maxCoeff() <= 1e-12 * most);
        sum += force;
        torque += (kGeneral * spec.particles->at(i).position).cross(force);
      }
      CHECK(sum.cwiseAbs().maxCoeff() <= 1e-12 * most);
      CHECK(torque.cwiseAbs().maxCoeff() <= 1e-12 * most);
    }
}

TEST_CASE("a turned solid costs no energy and feels no force") {
  sim::Registry registry = make_registry();
  const double c = std::cos(2.1), s = std::sin(2.1);
  const sim::Mat3 turn =
      sim::Mat3({c, -s, 0}, {s, c, 0}, {0, 0, 1}) * sim::Mat3({1, 0, 0}, {0, c, -s}, {0, s, c});
  for (const int order : {1, 2})
    for (const char* model : kModels) {
      const sim::SystemSpec spec = make_body({.order = order, .model = model, .young = 1});
      sim::Simulation body(spec, registry);
      deform(body, turn);
      INFO(model << ", order " << order);
      CHECK(std::abs(body.energy().potential) < 1e-14);
      CHECK(largest_of(forces_on(body, spec)) < 1e-13);
    }
}

// F = diag(s, b, b) with sides that are free: psi as a function of s and b.
TEST_CASE("uniaxial stretch has the stress of the closed form") {
  sim::Registry registry = make_registry();
  const auto [young, poisson] = moduli(2, 3);
  const double s = 1.25;
  const struct {
    const char* model;
    double b, stress;
  } cases[] = {// lambda tr E + 2 mu E_bb = 0:  b^2 = 1 - nu (s^2 - 1), stress E (s^3 - s) / 2.
               {"stvk", std::sqrt(1 - poisson * (s * s - 1)), young * (s * s * s - s) / 2},
               // b = 1 - nu (s - 1), stress E (s - 1).
               {"corotated", 1 - poisson * (s - 1), young * (s - 1)}};
  for (const int order : {1, 2})
    for (const auto& c : cases) {
      const sim::SystemSpec spec = make_body({.size = {3, 3, 3},
                                              .order = order,
                                              .model = c.model,
                                              .young = young,
                                              .poisson = poisson});
      sim::Simulation body(spec, registry);
      deform(body, sim::Mat3::Diagonal({s, c.b, c.b}));
      const std::vector<sim::Vec3> forces = forces_on(body, spec);
      double pull = 0, aside = 0;
      for (int i = 0; i < 27; ++i) {
        const sim::Vec3& force = forces[static_cast<std::size_t>(i)];
        if (i >= 18) pull -= force[0];
        aside = std::max({aside, std::abs(force[1]), std::abs(force[2])});
      }
      INFO(c.model << ", order " << order);
      CHECK(pull == Approx(c.stress).epsilon(1e-12));  // on 1 m^2 of the undeformed side
      CHECK(aside < 1e-12);
    }
}

TEST_CASE("forces of solids are minus the gradient of their energy, and their Jacobian is exact") {
  sim::Registry registry = make_registry();
  for (const int order : {1, 2})
    for (const char* model : kModels)
      for (const double shake : {0.15, 0.6}) {  // the second turns cells inside out
        if (shake > 0.5 && std::string(model) == "stvk") continue;
        const sim::SystemSpec spec = make_body({.order = order, .model = model});
        sim::Simulation body(spec, registry);
        std::vector<sim::Vec3> places;
        for (int i = 0; i < 27; ++i) {
          const auto noise = [&](int axis) { return shake * std::sin(1.0 + 7 * i + 3 * axis); };
          places.push_back(body.position(i) + 0.5 * sim::Vec3(noise(0), noise(1), noise(2)));
          body.set_position(i, places.back());
        }
        std::vector<sim::Vec3> expected;
        const double h = 1e-5;
        for (int i = 0; i < 27; ++i) {
          const sim::Vec3 x = places[static_cast<std::size_t>(i)];
          sim::Vec3 slope;
          for (std::size_t axis = 0; axis < 3; ++axis) {
            double energy[2];
            for (const int side : {0, 1}) {
              sim::Vec3 moved = x;
              moved[axis] += side ? h : -h;
              body.set_position(i, moved);
              energy[side] = body.energy().potential;
            }
            slope[axis] = -(energy[1] - energy[0]) / (2 * h);
          }
          body.set_position(i, x);
          expected.push_back(slope);
        }

        // J dx by its own blocks, and by differences of the right-hand side.
        sim::OdeSystem& ode = body.ode();
        sim::Array dx(ode.size()), own(ode.size()), differences(ode.size());
        for (std::size_t k = 0; k < dx.size(); ++k)
          dx[k] = std::sin(1.0 + 5.0 * static_cast<double>(k));
        const auto exact = ode.jacobian(), other = sim::difference_jacobian(ode);
        exact->at(0, body.state().data());
        exact->apply(dx.data(), own.data());
        other->at(0, body.state().data());
        other->apply(dx.data(), differences.data());
        double worst = 0, size = 0;
        for (std::size_t k = 0; k < dx.size(); ++k) {
          worst = std::max(worst, std::abs(own[k] - differences[k]));
          size = std::max(size, std::abs(own[k]));
        }

        INFO(model << ", order " << order << ", shaken by " << shake);
        CHECK(worst <= 1e-6 * size);
        const std::vector<sim::Vec3> forces = forces_on(body, spec);
        const double most = largest_of(forces);
        for (std::size_t i = 0; i < 27; ++i)
          CHECK((forces[i] - expected[i]).cwiseAbs().maxCoeff() <= 1e-7 * most);
      }
}

TEST_CASE("flat, inverted and vanished cells have finite forces") {
  sim::Registry registry = make_registry();
  const sim::Mat3 shapes[] = {sim::Mat3::Diagonal({1, 1, 0}),
                              sim::Mat3::Diagonal({0, 0, 2}),
                              sim::Mat3::Zero(),
                              sim::Mat3::Diagonal({1, 1, -1}),
                              sim::Mat3::Diagonal({-1, -1, -1}),
                              sim::Mat3::Diagonal({1, -3, 3}),
                              sim::Mat3::Diagonal({1e-200, 1, 1}),
                              sim::Mat3::Diagonal({1e50, 1e-50, 1})};
  for (const char* model : {"neo_hookean", "corotated"})
    for (const int order : {1, 2})
      for (const sim::Mat3& shape : shapes) {
        const sim::SystemSpec spec = make_body({.order = order, .model = model});
        sim::Simulation body(spec, registry, {.dt = 1e-60});
        deform(body, shape);
        INFO(model << ", order " << order << ", F_00 = " << shape(0, 0));
        CHECK(std::isfinite(body.energy().potential));
        CHECK(body.step());
      }
  // And a block that was turned inside out comes back.
  const sim::SystemSpec spec = make_body({.young = 100});
  sim::Simulation body(spec, registry, {.integrator = "implicit_euler", .dt = 0.05});
  deform(body, sim::Mat3::Diagonal({0.3, 1, 1}) * kGeneral);
  body.set_position(13, {-1, 0.2, 2});
  REQUIRE(run(body, 400));
  CHECK(body.energy().potential < 1e-3);
}

// A cantilever under its own weight against Timoshenko's beam. Linear cells lock, quadratic do not.
TEST_CASE("a cantilever bends as beam theory says where cells are quadratic or many") {
  sim::Registry registry = make_registry();
  const double young = 1e6, poisson = 0.3, density = 100, side = 0.1, length = 0.6, g = 0.01;
  const double w = density * g * side * side, inertia = std::pow(side, 4) / 12;
  const double theory =
      w * std::pow(length, 4) / (8 * young * inertia) +
      w * length * length / (2 * 5.0 / 6 * young / (2 * (1 + poisson)) * side * side);
  const auto sag = [&](int cells, int order) {
    const int n = cells * order;
    sim::SystemSpec spec = make_body({.size = {6 * n + 1, n + 1, n + 1},
                                      .step = sim::Vec3(side / n, side / n, side / n),
                                      .order = order,
                                      .model = "corotated",
                                      .young = young,
                                      .poisson = poisson,
                                      .density = density});
    hold_left(spec);
    spec.forces.push_back(make_part("gravity", {{"g", sim::Vec3(0, -g, 0)}}));
    // Backward Euler in steps far longer than every vibration is Newton's method for the rest.
    sim::Simulation beam(spec, registry, {.integrator = "implicit_euler", .dt = 1000});
    REQUIRE(run(beam, 4));
    return (side - beam.position(beam.particles() - 1)[1]) / theory;
  };
  const double one = sag(1, 1), two = sag(2, 1), quadratic = sag(1, 2);
  INFO("shares of the deflection: " << one << ", " << two << ", quadratic " << quadratic);
  CHECK(one < 0.4);
  CHECK(two > one + 0.15);
  CHECK(two < 0.8);
  CHECK(quadratic == Approx(1).margin(0.05));
}

// Along a thin bar, free at its ends, the lowest longitudinal frequency is c / (2 L), c^2 = E /
// rho, where poisson = 0.
TEST_CASE("the lowest longitudinal frequency of a bar") {
  sim::Registry registry = make_registry();
  const double c = std::sqrt(400.0 / 4), length = 1, period = 2 * length / c;
  const auto error_of = [&](int order, int steps) {
    const sim::SystemSpec spec = make_body({.size = {steps + 1, 3, 3},
                                            .step = sim::Vec3::Constant(length / steps),
                                            .order = order,
                                            .model = "corotated",
                                            .young = 400,
                                            .poisson = 0,
                                            .density = 4});
    sim::Simulation bar(spec, registry, {.integrator = "verlet", .dt = period / 2000});
    for (int i = 0; i < bar.particles(); ++i) {
      const sim::Vec3 x = bar.position(i);
      bar.set_position(i, x + sim::Vec3(1e-4 * std::cos(M_PI * x[0] / length), 0, 0));
    }
    // The share of the mode is 0 after a quarter of the period.
    const auto share = [&] {
      double sum = 0;
      for (int i = 0; i < bar.particles(); ++i) {
        const sim::ParticleSpec rest = spec.particles->at(i);
        sum += rest.mass * std::cos(M_PI * rest.position[0] / length) *
               (bar.position(i)[0] - rest.position[0]);
      }
      return sum;
    };
    double before = 0, now = share();
    int step = 0;
    while (now > 0) {
      before = now;
      REQUIRE(bar.step());
      ++step;
      now = share();
    }
    const double crossed = step - 1 + before / (before - now);
    return std::abs(4 * crossed / 2000 - 1);
  };
  for (const int order : {1, 2}) {
    const double coarse = error_of(order, 8), fine = error_of(order, 16);
    INFO("order " << order << ": " << coarse << ", " << fine);
    CHECK(fine < 5e-3);
    CHECK(fine < coarse / 3);
  }
}

TEST_CASE("solids have the same bits on any number of threads, and keep energy and momentum") {
  sim::Registry registry = make_registry();
  for (const int order : {1, 2}) {
    const sim::SystemSpec spec = make_body({.size = {25, 19, 19}, .order = order, .young = 100});
    std::uint64_t hash = 0;
    for (const int threads : {1, 2, 4}) {
      sim::Simulation body(spec, registry,
                           {.integrator = "verlet", .dt = 1e-3, .threads = threads});
      deform(body, kGeneral);
      REQUIRE(run(body, 2));
      if (threads == 1) hash = body.hash();
      CHECK(body.hash() == hash);
    }
    const sim::SystemSpec small = make_body({.order = order});
    sim::Simulation body(small, registry, {.integrator = {"dop853", {{"tol", 1e-11}}}, .dt = 0.25});
    deform(body, kGeneral);
    const double start = body.energy().potential;
    REQUIRE(run(body, 8));
    CHECK(body.energy().kinetic > 0.01 * start);
    CHECK(body.energy().kinetic + body.energy().potential == Approx(start).epsilon(1e-8));
    sim::Vec3 momentum;
    double size = 0;
    for (int i = 0; i < body.particles(); ++i) {
      momentum += small.particles->at(i).mass * body.velocity(i);
      size += small.particles->at(i).mass * body.velocity(i).norm();
    }
    CHECK(momentum.norm() <= 1e-12 * size);
  }
}

TEST_CASE("density gives the particles of a body its mass") {
  for (const int order : {1, 2}) {
    const sim::SystemSpec spec =
        make_body({.size = {5, 3, 3}, .step = {0.1, 0.2, 0.3}, .order = order, .density = 7});
    double mass = 0;
    for (int i = 0; i < 45; ++i) mass += spec.particles->at(i).mass;
    CHECK(mass == Approx(7 * 0.4 * 0.4 * 0.6).epsilon(1e-14));
  }
  sim::Registry registry = make_registry();
  sim::SystemSpec flat = make_body({.step = {0.5, 0, 0.5}, .density = 1});
  flat.particles->weights.clear();
  CHECK_THROWS_WITH(sim::Simulation(flat, registry), Catch::Contains("bad tetrahedron 1"));
}

namespace {

// Two cells of a unit cube's corner and its mirror behind the face 1 2 3, moved by `map`.
sim::CellQuality quality_of(const std::function<sim::Vec3(const sim::Vec3&)>& map) {
  const std::vector<sim::Vec3> rest{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};
  sim::FemForces cells(sim::solid_law(sim::ConstitutiveLaw::Model::kNeoHookean, 1, 0.3),
                       {0, 1, 2, 3, 4, 3, 2, 1}, 4);
  const auto with_view = [&](const std::vector<sim::Vec3>& places, const auto& use) {
    sim::Array x(5), y(5), z(5);
    for (std::size_t i = 0; i < 5; ++i) {
      x[i] = places[i][0];
      y[i] = places[i][1];
      z[i] = places[i][2];
    }
    use(sim::ParticleView{.n = 5, .x = x.data(), .y = y.data(), .z = z.data()});
  };
  with_view(rest, [&](const sim::ParticleView& view) { cells.bind(view); });
  std::vector<sim::Vec3> moved;
  for (const sim::Vec3& each : rest) moved.push_back(map(each));
  sim::CellQuality found;
  with_view(moved, [&](const sim::ParticleView& view) { found = cells.quality(view); });
  return found;
}

}  // namespace

// Simple shear x + s y has the stretches sqrt(1 + s^2 / 4) +- s / 2, and E = ((0, s), (s, s^2))
// / 2.
TEST_CASE("the quality of cells is that of their deformation", "[fem]") {
  using sim::Vec3;
  const double s = 0.6, root = std::sqrt(1 + s * s / 4);
  const auto shear = quality_of([&](const Vec3& x) { return Vec3(x[0] + s * x[1], x[1], x[2]); });
  CHECK(shear.cells == 2);
  CHECK(shear.inverted == 0);
  CHECK(shear.volume == Approx(1).epsilon(1e-14));
  CHECK(shear.most == Approx(root + s / 2).epsilon(1e-13));
  CHECK(shear.least == Approx(root - s / 2).epsilon(1e-13));
  const double a = shear.most * shear.most, b = shear.least * shear.least;
  CHECK(std::sin(shear.angle) == Approx((a - b) / (a + b)).epsilon(1e-13));
  CHECK(shear.strain_jump < 1e-14);

  // A turn is no deformation.
  const auto turned = quality_of([](const Vec3& x) { return Vec3(-x[1] + 3, x[0], x[2]); });
  CHECK(turned.most == Approx(1).epsilon(1e-14));
  CHECK(turned.angle < 1e-7);

  // One cell stays, the corner of the other is pushed through its face.
  const auto pushed = quality_of([](const Vec3& x) { return x[0] * x[1] > 0 ? 0.2 * x : x; });
  CHECK(pushed.inverted == 1);
  CHECK(pushed.smallest == 1);
  // The height over the face 1 2 3 goes from 2 / sqrt(3) to (0.6 - 1) / sqrt(3).
  CHECK(pushed.volume == Approx(-0.2).epsilon(1e-13));
  CHECK(pushed.jumps >= 0);

  // Half the height: F = 1 - n n^T / 2 in the second cell, which is twice as large as the first, at
  // rest. The mean around the shared corners is 2/3 of its E, so that the first differs by that.
  const auto half =
      quality_of([](const Vec3& x) { return x[0] * x[1] > 0 ? Vec3(2, 2, 2) / 3 : x; });
  CHECK(half.volume == Approx(0.5).epsilon(1e-13));
  const double along = 0.5, E = 0.5 * (along * along - 1);  // along n
  CHECK(half.least == Approx(along).epsilon(1e-13));
  CHECK(half.strain_jump == Approx(2 * std::abs(E) / 3).epsilon(1e-12));
}

TEST_CASE("long steps of a solid without a factorisation take few iterations, to the same state") {
  sim::Registry registry = make_registry();
  const auto stepped = [&](const char* solver) {
    sim::SystemSpec spec = make_body({.size = {21, 3, 3},
                                      .step = {0.05, 0.05, 0.05},
                                      .model = "corotated",
                                      .young = 5e6,
                                      .density = 200});
    hold_left(spec);
    spec.forces.push_back(make_part("gravity", {{"g", sim::Vec3(0, -9.81, 0)}}));
    auto beam = std::make_unique<sim::Simulation>(
        spec, registry,
        sim::RunOptions{
            .integrator = {"implicit_euler", {{"solver", std::string(solver)}, {"tol", 1e-7}}},
            .dt = 0.01});
    REQUIRE(run(*beam, 2));
    return beam;
  };
  const auto iterated = stepped("cg"), factorised = stepped("ldlt");
  double apart = 0;
  for (int i = 0; i < iterated->particles(); ++i)
    apart = std::max(apart, (iterated->position(i) - factorised->position(i)).norm());
  const sim::Effort effort = iterated->integrator().effort();
  INFO(effort.linear << " iterations in " << effort.newton << " Newton steps");
  CHECK(apart < 1e-8);
  CHECK(effort.linear < 200 * effort.newton);
}
