#include "tests/bench/implicit.h"

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCholesky>
#ifdef SIM_BENCH_CHOLMOD
#include <Eigen/CholmodSupport>
#endif
#include <algorithm>
#include <cmath>
#include <memory>

#include "tests/bench/cloth.h"
#include "tests/bench/eigen_step.h"
#include "tests/bench/kernel.h"
#include "tests/bench/memory.h"

namespace sim_bench {
namespace {

constexpr double kStep = 0.01, kResidual = 1e-6;  // s
constexpr int kLargestFactor = 128;  // particles a side: beyond, a factorisation takes minutes
constexpr int kLargestVerlet = 256;  // beyond, so does verlet
constexpr int kLargestSolved = 128;  // to a residual of 1e-6; beyond, that takes minutes, too

struct Case {
  int n;
  double k;
};

sim::SystemSpec stiff_cloth(const Case& c, sim::Registry& registry) {
  sim::SystemSpec spec = load_cloth(c.n, registry);
  std::erase_if(spec.forces, [](const sim::PartSpec& force) { return force.plugin == "drag"; });
  for (sim::PartSpec& force : spec.forces)
    if (force.plugin == "spring")
      force.given["stiffness"] = c.k / 100 * number_of(force.given["stiffness"]);
  return spec;
}

// Steps of a run, from rest.
int steps_of(int n) { return n <= 64 ? 4 : 2; }

double mass_of(int n) { return 1.0 / n / n; }

// 0.9 of the largest stable step of verlet: omega^2 <= 2/m sum k = 14 k / m.
int verlet_steps(const Case& c) {
  const double limit = 2 / std::sqrt(14 * c.k / mass_of(c.n));
  return static_cast<int>(std::ceil(kStep / (0.9 * limit)));
}

// All contestants of a size, with what they have to say afterwards.
class Race {
 public:
  Race(const Case& c, sim::Registry& registry)
      : case_(c), spec_(stiff_cloth(c, registry)), registry_(registry) {}

  void add_kernel(const std::string& name, const sim::MethodChoice& method, int substeps = 1) {
    auto simulation = std::make_unique<sim::Simulation>(
        spec_, registry_, sim::RunOptions{.integrator = method, .dt = kStep / substeps});
    sim::Simulation& s = *simulation;
    add(name, substeps == 1 ? steps_of(case_.n) : 1, [&s, substeps](int steps) {
      s.reset();
      for (int left = steps * substeps; left > 0;) left -= s.steps(left);
    });
    results_.back().bytes =
        substeps == 1 ? measure_memory(case_.n, method.name).resident / (1.0 * case_.n * case_.n)
                      : 0;
    kernels_.emplace_back(results_.size() - 1, std::move(simulation));
  }

  template <class Solver>
  void add_eigen(const std::string& name, Solver& solver, bool iterative = false) {
    const sim::Simulation scene(spec_, registry_, {.integrator = {"verlet", {}}, .dt = kStep});
    steps_.emplace_back(results_.size(),
                        std::make_unique<EigenStep>(scene, mass_of(case_.n), kStep));
    EigenStep& step = *steps_.back().second;
    solver.analyzePattern(step.matrix());
    add(name, iterative ? steps_of(case_.n) : 1, [&step, &solver](int steps) {
      step.reset();
      for (int i = 0; i < steps; ++i)
        step.step([&](const auto& a, const auto& b, auto& x) {
          solver.factorize(a);
          x = solver.solve(b);
        });
    });
  }

  std::vector<ImplicitResult> run(const TimingOptions& timing) {
    const std::vector<Times> times = measure(contestants_, timing);
    for (std::size_t i = 0; i < times.size(); ++i)
      results_[i].times = {times[i].median / counts_[i], times[i].least / counts_[i],
                           times[i].most / counts_[i]};
    for (const auto& [at, simulation] : kernels_) {
      const sim::Effort effort = simulation->integrator().effort();
      if (effort.newton == 0) continue;
      const auto steps = static_cast<double>(effort.steps);
      results_[at].newton = static_cast<double>(effort.newton) / steps;
      results_[at].iterations = static_cast<double>(effort.linear) / steps;
    }
    for (const auto& [at, step] : steps_) results_[at].residual = step->residual();
    return std::move(results_);
  }

  ImplicitResult& last() { return results_.back(); }

 private:
  // step(count): that many from rest; a factorisation takes as long at any of them.
  void add(const std::string& name, int count, std::function<void(int)> step) {
    results_.emplace_back();
    results_.back().n = case_.n;
    results_.back().k = case_.k;
    results_.back().what = name;
    counts_.push_back(count);
    contestants_.push_back({[step = std::move(step), count](long runs) {
      const double start = seconds_now();
      for (long i = 0; i < runs; ++i) step(count);
      return seconds_now() - start;
    }});
  }

  Case case_;
  sim::SystemSpec spec_;
  sim::Registry& registry_;
  std::vector<ImplicitResult> results_;
  std::vector<Contestant> contestants_;
  std::vector<int> counts_;  // steps of a run of each
  std::vector<std::pair<std::size_t, std::unique_ptr<sim::Simulation>>> kernels_;
  std::vector<std::pair<std::size_t, std::unique_ptr<EigenStep>>> steps_;
};

void measure_case(const Case& c, const Options& options, sim::Registry& registry,
                  std::vector<ImplicitResult>& results) {
  Race race(c, registry);
  race.add_kernel("one linearised step", {"implicit_euler",
                                          {{"newton_steps", std::int64_t{1}},
                                           {"hessian", std::string("clamped")},
                                           {"solver", std::string("cg")},
                                           {"tol", kResidual}}});
  race.last().residual = kResidual;
  for (const char* const method : {"implicit_euler", "trbdf2", "bdf2"})
    race.add_kernel(method, {method});
  if (c.n <= kLargestSolved)
    race.add_kernel("implicit_euler, tol = 1e-6", {"implicit_euler", {{"tol", kResidual}}});
  if (c.n <= kLargestFactor) race.add_kernel("projective_dynamics", {"projective_dynamics", {}});
  if (c.n <= kLargestVerlet)
    race.add_kernel("verlet, 0.9 of its limit", {"verlet", {}}, verlet_steps(c));

  using Matrix = EigenStep::Matrix;
  Eigen::ConjugateGradient<Matrix, Eigen::Lower | Eigen::Upper> cg;
  cg.setTolerance(kResidual);
  Eigen::SimplicialLDLT<Matrix> ldlt;
#ifdef SIM_BENCH_CHOLMOD
  Eigen::CholmodSupernodalLLT<Matrix> cholmod;
#endif
  if (c.n <= kLargestFactor) {
    race.add_eigen("linearised: Eigen, ConjugateGradient", cg, true);
    race.add_eigen("linearised: Eigen, SimplicialLDLT", ldlt);
#ifdef SIM_BENCH_CHOLMOD
    race.add_eigen("linearised: CHOLMOD, supernodal", cholmod);
#endif
  }
  TimingOptions timing = options.timing;
  if (c.n >= 64) timing.repeats = c.n == 64 ? 3 : 1;
  for (ImplicitResult& result : race.run(timing)) results.push_back(std::move(result));
}

}  // namespace

std::vector<ImplicitResult> measure_implicit(const Options& options, sim::Registry& registry) {
  std::vector<ImplicitResult> results;
  for (const double k : {1e5, 1e7})
    for (const int n : {32, 64, 128, 256, 512}) measure_case({n, k}, options, registry, results);
  return results;
}

Table implicit_table(const std::vector<ImplicitResult>& results) {
  Table table("implicit", "0.01 s of a stiff n x n cloth, one thread",
              {{"n", "n"},
               {"k", "k"},
               {"what", "what", false},
               {"ms", "ms"},
               {"min", "ms_min"},
               {"max", "ms_max"},
               {"Newton", "newton"},
               {"iterations", "iterations"},
               {"us/particle", "us_per_particle"},
               {"x linearised", "times_linearised"},
               {"residual", "residual"},
               {"B/particle", "bytes_per_particle"}});
  double kernel = 1;
  const auto number = [](double value) { return value > 0 ? short_number(value) : ""; };
  for (const ImplicitResult& r : results) {
    if (r.what.starts_with("one ")) kernel = r.times.median;
    table.add({std::to_string(r.n), number(r.k), r.what, number(r.times.median * 1e3),
               number(r.times.least * 1e3), number(r.times.most * 1e3), number(r.newton),
               number(r.iterations), number(r.times.median * 1e6 / r.n / r.n),
               number(r.times.median / kernel), number(r.residual), number(r.bytes)});
  }
  table.note(
      "Steps of 0.01 s, the first four from rest (two from 128 x 128 on); 1 kg in all, no drag, "
      "stiffness k, k/2 and k/4 "
      "N/m. "
      "Eigen and CHOLMOD: the same linearised step, assembled into a fixed pattern, with the "
      "default preconditioner or with the symbolic factorisation made once; residual is that of "
      "their last step. Memory: beyond the scene, of the default cloth.");
#ifndef SIM_BENCH_CHOLMOD
  table.note("CHOLMOD: not found when this was built; apt-get install libsuitesparse-dev");
#endif
  return table;
}

}  // namespace sim_bench
