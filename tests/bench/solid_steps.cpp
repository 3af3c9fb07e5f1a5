#include "tests/bench/solid_steps.h"

#include <Eigen/SparseCholesky>
#ifdef SIM_BENCH_CHOLMOD
#include <Eigen/CholmodSupport>
#endif
#include <algorithm>
#include <cmath>
#include <iostream>

#include "core/base/thread_pool.h"
#include "core/lua/scene/scene_file.h"
#include "core/particles/particle_system.h"
#include "core/scene/simulation.h"

namespace sim_bench {
namespace {

constexpr double kStep = 0.01, kMostSeconds = 60;  // for a step of the kernel
constexpr int kRuns = 3, kManyNodes = 50000;  // of which one run takes minutes

using Matrix = Eigen::SparseMatrix<double>;
#ifdef SIM_BENCH_CHOLMOD
using Factors = Eigen::CholmodSupernodalLLT<Matrix, Eigen::Lower>;
const char* const kPeer = "CHOLMOD, supernodal";
#else
using Factors = Eigen::SimplicialLDLT<Matrix, Eigen::Lower>;
const char* const kPeer = "Eigen, SimplicialLDLT (CHOLMOD is in libsuitesparse-dev)";
#endif

struct Case {
  int cells, order;
  double poisson;
};

sim::SystemSpec beam_of(const Case& c, sim::Registry& registry) {
  sim::SceneOptions options;
  options.search_path = {SIM_BENCH_SCRIPTS};
  options.settings = {{"cells", std::to_string(c.cells)}, {"order", std::to_string(c.order)}};
  sim::SystemSpec spec = sim::load_scene("scenes/beam.lua", registry, options).systems.front();
  for (sim::PartSpec& force : spec.forces)
    if (force.plugin == "fem") force.given["poisson"] = c.poisson;
  return spec;
}

// Collects the lower half of -df/dx of free particles.
class Triplets final : public sim::JacobianSink {
 public:
  explicit Triplets(std::span<const double> masses) {
    for (const double mass : masses) {
      row_.push_back(std::isfinite(mass) ? 3 * free_++ : -1);
      if (row_.back() < 0) continue;
      for (int axis = 0; axis < 3; ++axis)
        entries_.emplace_back(row_.back() + axis, row_.back() + axis, mass / kStep / kStep);
    }
  }
  void position(int i, int j, const sim::Mat3& block) override {
    const int row = row_[static_cast<std::size_t>(i)], column = row_[static_cast<std::size_t>(j)];
    if (row < column || column < 0) return;
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c)
        if (row > column || r >= c)
          entries_.emplace_back(row + static_cast<int>(r), column + static_cast<int>(c),
                                -block(r, c));
  }
  void velocity(int, int, const sim::Mat3&) override {}

  Matrix matrix() const {
    Matrix all(3 * free_, 3 * free_);
    all.setFromTriplets(entries_.begin(), entries_.end());
    return all;
  }

 private:
  int free_ = 0;
  std::vector<int> row_;
  std::vector<Eigen::Triplet<double>> entries_;
};

Matrix matrix_of(sim::Simulation& beam) {
  const auto& system = dynamic_cast<const sim::ParticleSystem&>(beam.ode());
  const sim::ParticleView view = system.view(0, beam.state().data());
  sim::ThreadPool alone(1);
  Triplets blocks(system.masses());
  for (sim::Force* const force : system.other_forces()) {
    force->prepare(view, alone);
    force->jacobian(view, blocks);
  }
  return blocks.matrix();
}

SolidStepResult measure_case(const Case& c, sim::Registry& registry) {
  sim::Simulation beam(beam_of(c, registry), registry,
                       {.integrator = {"implicit_euler", {}}, .dt = kStep});
  SolidStepResult result;
  result.nodes = beam.particles();
  result.order = c.order;
  result.poisson = c.poisson;
  const Matrix matrix = matrix_of(beam);
  const Eigen::VectorXd rhs = Eigen::VectorXd::Ones(matrix.rows());
  Factors factors;
  factors.analyzePattern(matrix);
  std::vector<double> ours, theirs;
  for (int run = 0; run < (result.nodes > kManyNodes ? 1 : kRuns); ++run) {
    double start = seconds_now();
    factors.factorize(matrix);
    const Eigen::VectorXd x = factors.solve(rhs);
    theirs.push_back(seconds_now() - start);
    if (!((matrix.selfadjointView<Eigen::Lower>() * x - rhs).norm() < 1e-8 * rhs.norm())) break;

    beam.reset();
    const sim::Effort before = beam.integrator().effort();
    start = seconds_now();
    beam.stop_when([start] { return seconds_now() - start > kMostSeconds; });
    result.finished = beam.step();
    const double seconds = seconds_now() - start;
    const sim::Effort after = beam.integrator().effort();
    const auto newtons = static_cast<double>(after.newton - before.newton);
    ours.push_back(seconds / std::max(newtons, 1.0));
    result.newtons = newtons;
    result.iterations = static_cast<double>(after.linear - before.linear) / std::max(newtons, 1.0);
    if (!result.finished) break;
  }
  result.newton = times_of(ours);
  result.peer = times_of(theirs);
  return result;
}

}  // namespace

std::vector<SolidStepResult> measure_solid_steps(const Options& options, sim::Registry& registry) {
  std::vector<SolidStepResult> results;
  for (const int size : {4, 9, 21}) {
    if (size == 21 && options.quick) continue;
    for (const double poisson : {0.3, 0.49})
      for (const int order : {1, 2}) {
        const Case c{order == 1 ? size : size / 2, order, poisson};
        std::cerr << "bench: a beam with " << c.cells << " cells of order " << order << "\n";
        results.push_back(measure_case(c, registry));
      }
  }
  return results;
}

Table solid_step_table(const std::vector<SolidStepResult>& results) {
  Table table("solid steps", "A Newton step of an implicit step of 0.01 s of a beam, one thread",
              {{"nodes", "nodes"},
               {"order", "order"},
               {"nu", "poisson"},
               {"ms", "ms"},
               {"min", "ms_min"},
               {"Newton", "newton"},
               {"iterations", "iterations"},
               {"peer ms", "peer_ms"},
               {"min", "peer_ms_min"},
               {"x peer", "times_peer"}});
  for (const SolidStepResult& r : results) {
    const auto ours = [&](double value) { return r.finished ? short_number(value) : ""; };
    table.add({std::to_string(r.nodes), std::to_string(r.order), short_number(r.poisson),
               ours(r.newton.median * 1e3), ours(r.newton.least * 1e3), ours(r.newtons),
               ours(r.iterations), short_number(r.peer.median * 1e3),
               short_number(r.peer.least * 1e3), ours(r.newton.least / r.peer.least)});
  }
  table.note(
      std::string("peer: ") + kPeer +
      ", factorises and solves M / h^2 + K at rest, with its symbolic part made once. Ours "
      "includes the forces, their Jacobian and the search along a line; iterations are those "
      "of the linear solver in a Newton step. Empty: no step within " +
      short_number(kMostSeconds) + " s.");
  return table;
}

}  // namespace sim_bench
