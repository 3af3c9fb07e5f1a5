// The scenes of first order against references of the literature: the test set for IVP solvers
// (Mazzia & Magherini 2008), Hairer & Wanner, Solving ODEs II (1996), and closed forms.
#include <algorithm>
#include <cmath>

#include "tests/lua/scene_text.h"
#include "tests/support/scenes.h"

using namespace sim_test;
using sim::test::load;

namespace {

std::vector<double> end_of(const std::string& scene, const std::string& integrator, double tol,
                           const sim::test::Settings& settings = {}, double time = 0) {
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec = load("scenes/" + scene + ".lua", settings).systems[0];
  sim::RunOptions options{.integrator = integrator, .dt = time > 0 ? time : spec.duration};
  options.integrator.given["tol"] = tol;
  sim::Simulation simulation(spec, registry, options);
  REQUIRE(simulation.step());
  return state_of(simulation);
}

// |x_i - exact_i| <= times tol (1 + |exact_i|)
void check_near(const std::vector<double>& x, const std::vector<double>& exact, double allowed) {
  for (std::size_t i = 0; i < exact.size(); ++i) {
    INFO("number " << i << " is " << x[i]);
    CHECK(std::fabs(x[i] - exact[i]) <= allowed * (1 + std::fabs(exact[i])));
  }
}

const std::vector<double> kHires = {
    0.7371312573325668e-3, 0.1442485726316185e-3, 0.5888729740967575e-4, 0.1175651343283149e-2,
    0.2386356198831331e-2, 0.6238968252742796e-2, 0.2849998395185769e-2, 0.2850001604814231e-2};
const std::vector<double> kOregonator = {0.1000814870318523e1, 0.1228178521549917e4,
                                         0.1320554942846706e3};
const std::vector<double> kRobertson = {0.7158270687193941, 9.185534764557338e-6,
                                        0.2841637457458412};
const std::vector<double> kVanDerPol = {1.706167732170483, -0.8928097010247975e-3};
const std::vector<double> kPleiades = {
    0.3706139143970502,    0.3237284092057233e1, -0.3222559032418324e1, 0.6597091455775310,
    0.3425581707156584,    0.1562172101400631e1, -0.7003092922212495,   -0.3943437585517392e1,
    -0.3271380973972550e1, 0.5225081843456543e1, -0.2590612434977470e1, 0.1198213693392275e1,
    -0.2429682344935824,   0.1091449240428980e1};

}  // namespace

TEST_CASE("stiff scenes follow their tolerance to the references, with each stiff method") {
  for (const double tol : {1e-5, 1e-7, 1e-9}) {
    INFO("tol " << tol);
    for (const char* method : {"bdf", "esdirk43", "rodas4"}) {
      INFO(method);
      check_near(end_of("robertson", method, tol), kRobertson, 100 * tol);
      check_near(end_of("van_der_pol", method, tol), kVanDerPol, 1000 * tol);
      check_near(end_of("hires", method, tol), kHires, 100 * tol);
      check_near(end_of("oregonator", method, tol), kOregonator, 1000 * tol);
    }
  }
}

TEST_CASE("stars and satellites follow their tolerance to the references") {
  for (const double tol : {1e-9, 1e-11, 1e-13}) {
    INFO("tol " << tol);
    check_near(end_of("pleiades", "dop853", tol), kPleiades, std::max(1e4 * tol, 1e-11));
    const std::vector<double> orbit = end_of("arenstorf", "dop853", tol);
    CHECK(std::hypot(orbit[0] - 0.994, orbit[1]) < std::max(1e5 * tol, 1e-8));
  }
}

TEST_CASE("heat decays as its modes do, with every implicit method and Lua as with formulas") {
  for (const char* method : {"bdf", "esdirk43", "rodas4"})
    for (const double tol : {1e-4, 1e-6, 1e-8}) {
      INFO(method << ", tol " << tol);
      const double rate = 4 * 101 * 101 * std::pow(std::sin(M_PI / 202), 2);
      const std::vector<double> u = end_of("heat", method, tol);
      for (int i = 1; i <= 100; ++i)
        CHECK(std::fabs(u[static_cast<std::size_t>(i - 1)] -
                        std::sin(M_PI * i / 101) * std::exp(-rate * 0.2)) < 20 * tol);
    }
}

TEST_CASE("methods of other kinds agree on the Brusselator, in one direction and in two") {
  const std::vector<double> line = end_of("brusselator", "dop853", 1e-10, {{"n", "40"}});
  for (const double tol : {1e-4, 1e-6, 1e-8})
    for (const char* method : {"bdf", "esdirk43", "rodas4"}) {
      INFO(method << ", tol " << tol);
      check_near(end_of("brusselator", method, tol, {{"n", "40"}}), line, 50 * tol);
    }
  const std::vector<double> square = end_of("brusselator2d", "dop853", 1e-9, {{"n", "12"}});
  check_near(end_of("brusselator2d", "bdf", 1e-7, {{"n", "12"}}), square, 1e-5);
  check_near(end_of("brusselator2d", "esdirk43", 1e-7, {{"n", "12"}}), square, 1e-5);
  check_near(end_of("brusselator2d", "rodas4", 1e-7, {{"n", "12"}}), square, 1e-5);
}

TEST_CASE("bdf takes as many steps as its orders promise, however often it is looked at") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec = load("scenes/hires.lua").systems[0];
  const auto run_in = [&](int count, std::int64_t& steps) {
    sim::RunOptions options{.integrator = "bdf", .dt = spec.duration / count};
    options.integrator.given["tol"] = 1e-8;
    sim::Simulation simulation(spec, registry, options);
    REQUIRE(run(simulation, count));
    steps = simulation.integrator().effort().steps;
    // A Jacobian and its factors serve many steps.
    CHECK(simulation.integrator().effort().factorisations < steps / 3);
    return state_of(simulation);
  };
  std::int64_t once = 0, often = 0;
  const std::vector<double> at_once = run_in(1, once), seen = run_in(1 << 10, often);
  CHECK(once == often);
  CHECK(once < 600);
  check_near(seen, at_once, 1e-12);
}

TEST_CASE("implicit methods on fields go on bit for bit from a snapshot") {
  sim::Registry registry = make_registry();
  const std::string lua =
      "return sim.scene { state = {2, 0}, field = sim.field.lua { function(t, y) return { y[2], "
      "100*(1 - y[1]^2)*y[2] - y[1] } end }, integrator = 'bdf', dt = 3, duration = 300 }";
  const sim::SystemSpec specs[] = {load("scenes/brusselator.lua", {{"n", "20"}}).systems[0],
                                   sim::test::load_text(lua).systems[0]};
  for (const sim::SystemSpec& spec : specs)
    for (const char* method : {"bdf", "esdirk43", "rodas4", "implicit_euler", "implicit_midpoint",
                               "trbdf2", "bdf2", "auto"}) {
      INFO(spec.name << ", " << method);
      const sim::RunOptions options{.integrator = std::string(method), .dt = 0.05};
      sim::Simulation whole(spec, registry, options), parted(spec, registry, options);
      REQUIRE(run(whole, 23));
      const sim::Snapshot middle = whole.snapshot();
      REQUIRE(run(whole, 40));
      parted.restore(middle);
      REQUIRE(run(parted, 40));
      CHECK(parted.hash() == whole.hash());
    }
}
