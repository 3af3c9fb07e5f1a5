// The error that a verdict tells is Richardson's, evaluated by runs of other steps.
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/study/judged_run.h"

using namespace sim_test;

namespace {

using States = std::vector<std::vector<double>>;

// The states after each `stride` steps of a run.
States states_of_run(const sim::SystemSpec& spec, const sim::RunOptions& options,
                     std::int64_t steps, std::int64_t stride) {
  sim::Registry registry = make_registry();
  sim::Simulation system(spec, registry, options);
  States states;
  for (std::int64_t n = 0; n <= steps; ++n) {
    if (n > 0) REQUIRE(system.step());
    if (n % stride == 0) states.push_back(state_of(system));
  }
  return states;
}

double farthest(const States& run, const States& other, std::size_t each) {
  double most = 0;
  for (std::size_t k = 0; k * each < run.size() && k < other.size(); ++k)
    for (std::size_t i = 0; i < run[k * each].size(); ++i)
      most = std::max(most, std::abs(run[k * each][i] - other[k][i]));
  return most;
}

// Richardson (1911): err = C h^p, so that runs with c h and h / k differ from it by err (c^p - 1)
// and err (1 - k^-p), from whose ratio p follows; p is at most the order, which it is taken for
// from 3/4 of that ratio's order on, and at least that at which err is four times the difference.
double richardson(double coarse, double fine, double c, double k, double order) {
  const auto ratio = [&](double p) { return (std::pow(c, p) - 1) / (1 - std::pow(k, -p)); };
  double p = order;
  if (coarse / fine <= ratio(0.75 * order)) {
    p = std::log(4.0 / 3) / std::log(k);
    while (p < order && ratio(p) < coarse / fine) p += 1e-6;
  }
  return fine / (1 - std::pow(k, -p));
}

}  // namespace

TEST_CASE("the error is Richardson's, from runs with half and with twice the step") {
  // Smooth; with a kink that no step meets; with jumps.
  const auto oscillator = make_oscillator();
  const auto kink = make_field({0, 1}, [](double t, std::span<const double>, std::span<double> d) {
    d[0] = std::sqrt(std::abs(t - 0.73));
    d[1] = -std::abs(std::sin(3 * t));
  });
  const auto jumps = make_field({0}, [](double t, std::span<const double>, std::span<double> d) {
    d[0] = std::sin(5 * t) > 0.3 ? 1 : 0;
  });
  int kinds[3] = {};  // of the order, of a lower one, of none
  for (const sim::SystemSpec& spec : {oscillator, kink, jumps})
    for (const char* const method : {"euler", "midpoint", "rk3", "rk4", "trbdf2"})
      for (const auto& [steps, finer] : {std::pair<std::int64_t, int>{100, 2}, {20, 4}}) {
        INFO(spec.first_order->state.size() << " numbers, " << method << ", " << steps);
        const double h = 2.0 / double(steps);
        const auto with = [&](double dt) {
          return sim::RunOptions{.integrator = method, .dt = dt};
        };
        const States run = states_of_run(spec, with(h), steps, 1),
                     fine = states_of_run(spec, with(h / finer), finer * steps, finer),
                     coarse = states_of_run(spec, with(2 * h), steps / 2, 1);
        // The states of the moments that the coarser run has, too.
        States even;
        for (std::size_t i = 0; i < fine.size(); i += 2) even.push_back(fine[i]);
        sim::Registry registry = make_registry();
        const double order = info_of(method, registry).order, seen = farthest(run, even, 2),
                     told = richardson(farthest(run, coarse, 2), seen, 2, finer, order);
        const Judged found = judged(spec, with(h), steps, static_cast<int>(steps));
        REQUIRE(found.deviation.verified());
        CHECK(found.deviation.error == Approx(farthest(run, fine, 1) * told / seen).epsilon(1e-4));
        const double factor = told / seen;
        ++kinds[factor > 3.99 ? 2 : factor > 1.01 / (1 - std::pow(finer, -order)) ? 1 : 0];
      }
  CHECK((kinds[0] > 5 && kinds[1] > 5 && kinds[2] > 0));
}

// The same of tolerances, of which errors are taken to be multiples: order 1.
TEST_CASE(
    "the error of an adaptive run is Richardson's, from tolerances of a tenth and ten times") {
  for (const double tol : {1e-4, 1e-6, 1e-8}) {
    constexpr std::int64_t kSteps = 4000;  // states, as many as the refined run has
    const auto with = [&](double tolerance) {
      sim::RunOptions options{.integrator = "dopri5", .dt = 0.005};
      options.integrator.given["tol"] = tolerance;
      return options;
    };
    const auto spec = make_oscillator();
    const States run = states_of_run(spec, with(tol), kSteps, 40),
                 fine = states_of_run(spec, with(tol / 10), kSteps, 40),
                 coarse = states_of_run(spec, with(10 * tol), kSteps, 40);
    const Judged found = judged(spec, with(tol), kSteps);
    INFO(tol);
    CHECK(found.deviation.error ==
          Approx(richardson(farthest(run, coarse, 1), farthest(run, fine, 1), 10, 10, 1))
              .epsilon(1e-4));
  }
}

// Roundings have no order: what differs is taken for an error of the order of the method.
TEST_CASE("the error of single precision is that of its distance from double precision") {
  sim::RunOptions options{.integrator = "rk4", .dt = 0.001};
  const sim::SystemSpec row = make_row(1, 0.1);
  const States fine = states_of_run(row, {.integrator = "rk4", .dt = 0.0005}, 4000, 40);
  options.integrator.given["precision"] = std::string("single");
  const States run = states_of_run(row, options, 2000, 20);
  double most = 0;
  for (std::size_t k = 0; k < run.size(); ++k)
    for (std::size_t i = 0; i < run[k].size(); i += 6)  // along x alone
      most = std::max(most, std::abs(run[k][i] - fine[k][i]));
  CHECK(judged(row, options, 2000).deviation.error ==
        Approx(most / (1 - std::pow(2.0, -4))).epsilon(1e-6));
}
