#include "tests/bench/implicit.h"

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

#include "tests/bench/cloth.h"
#include "tests/bench/kernel.h"

namespace sim_bench {
namespace {

constexpr double kStep = 0.01, kResidual = 1e-6;  // s
constexpr int kLargestFactor = 32;  // particles a side: beyond, a factorisation takes seconds

Eigen::Vector3d of_eigen(const sim::Vec3& v) { return {v.x(), v.y(), v.z()}; }

sim::SystemSpec stiff_cloth(int n, sim::Registry& registry) {
  sim::SystemSpec spec = load_cloth(n, registry);
  std::erase_if(spec.forces, [](const sim::PartSpec& force) { return force.plugin == "drag"; });
  for (sim::PartSpec& force : spec.forces)
    if (force.plugin == "spring")
      force.given["stiffness"] = 1000 * number_of(force.given["stiffness"]);
  spec.particles->grid->mass = 1;
  return spec;
}

// The same step as anyone would write it with Eigen: (M + h^2 K) dv = h (F - h K v), assembled into
// a pattern that is made once; pinned particles have no rows.
class EigenStep {
 public:
  using Matrix = Eigen::SparseMatrix<double>;

  explicit EigenStep(const sim::Simulation& scene) {
    int rows = 0;
    for (int i = 0; i < scene.particles(); ++i) {
      x_.push_back(of_eigen(scene.position(i)));
      v_.push_back(of_eigen(scene.velocity(i)));
      for (const sim::Link& link : scene.links(i))
        if (link.to > i) springs_.push_back({i, link.to, link.stiffness, link.rest, {}});
    }
    const int side = static_cast<int>(std::lround(std::sqrt(scene.particles())));
    for (int i = 0; i < scene.particles(); ++i)
      row_.push_back(i == 0 || i == side - 1 ? -1 : 3 * rows++);
    std::vector<Eigen::Triplet<double>> entries;
    const auto add = [&](int row, int col) {
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) entries.emplace_back(row + r, col + c, 0.0);
    };
    for (const int row : row_)
      if (row >= 0) add(row, row);
    for (const Spring& s : springs_)
      if (row_[s.a] >= 0 && row_[s.b] >= 0) {
        add(row_[s.a], row_[s.b]);
        add(row_[s.b], row_[s.a]);
      }
    matrix_.resize(3 * rows, 3 * rows);
    matrix_.setFromTriplets(entries.begin(), entries.end());
    for (Spring& s : springs_) {
      const int ends[2] = {row_[s.a], row_[s.b]};
      for (int e = 0; e < 4; ++e)
        for (int col = 0; col < 3; ++col)
          s.at[e][col] = ends[e % 2] < 0 ? 0 : entry(ends[e / 2], ends[e % 2] + col);
    }
    for (const int row : row_)
      for (int col = 0; row >= 0 && col < 3; ++col)
        diagonal_.push_back(entry(row, row + col) + col);
    rhs_.setZero(3 * rows);
    dv_.setZero(3 * rows);
  }

  template <class Solve>
  void step(const Solve& solve) {
    constexpr double h = kStep;
    std::fill_n(matrix_.valuePtr(), matrix_.nonZeros(), 0.0);
    for (const int at : diagonal_) matrix_.valuePtr()[at] = 1;
    for (std::size_t i = 0; i < x_.size(); ++i)
      if (row_[i] >= 0) rhs_.segment<3>(row_[i]) = Eigen::Vector3d(0, -9.81 * h, 0);
    for (const Spring& s : springs_) {
      const Eigen::Vector3d d = x_[s.a] - x_[s.b];
      const double length = d.norm();
      const Eigen::Vector3d u = d / length;
      const double along = std::max(0.0, s.k * (1 - s.rest / length));
      const Eigen::Matrix3d k =
          along * Eigen::Matrix3d::Identity() + (s.k - along) * u * u.transpose();
      const Eigen::Vector3d push =
          -h * (s.k * (length - s.rest) * u + h * (k * (v_[s.a] - v_[s.b])));
      const int ends[2] = {row_[s.a], row_[s.b]};
      if (ends[0] >= 0) rhs_.segment<3>(ends[0]) += push;
      if (ends[1] >= 0) rhs_.segment<3>(ends[1]) -= push;
      for (int e = 0; e < 4; ++e)
        if (ends[e / 2] >= 0 && ends[e % 2] >= 0)
          for (int col = 0; col < 3; ++col)
            for (int row = 0; row < 3; ++row)
              matrix_.valuePtr()[s.at[e][col] + row] += (e % 3 == 0 ? h * h : -h * h) * k(row, col);
    }
    solve(matrix_, rhs_, dv_);
    for (std::size_t i = 0; i < x_.size(); ++i) {
      if (row_[i] < 0) continue;
      v_[i] += dv_.segment<3>(row_[i]);
      x_[i] += h * v_[i];
    }
  }

  const Matrix& matrix() const { return matrix_; }
  sim::Vec3 position(std::size_t i) const { return {x_[i].x(), x_[i].y(), x_[i].z()}; }

 private:
  struct Spring {
    int a, b;
    double k, rest;
    int at[4][3];  // where its columns begin in the values: aa, ab, ba, bb
  };

  int entry(int row, int col) const {
    if (row < 0) return 0;
    const int* const inner = matrix_.innerIndexPtr();
    const int* const begin = inner + matrix_.outerIndexPtr()[col];
    const int* const end = inner + matrix_.outerIndexPtr()[col + 1];
    return static_cast<int>(std::lower_bound(begin, end, row) - inner);
  }

  std::vector<Eigen::Vector3d> x_, v_;
  std::vector<Spring> springs_;
  std::vector<int> row_, diagonal_;
  Matrix matrix_;
  Eigen::VectorXd rhs_, dv_;
};

template <class Solve>
Contestant contestant_of(EigenStep& step, const Solve& solve) {
  return {[&step, solve](long count) {
    const double start = seconds_now();
    for (long i = 0; i < count; ++i) step.step(solve);
    return seconds_now() - start;
  }};
}

void measure_size(int n, const Options& options, sim::Registry& registry,
                  std::vector<ImplicitResult>& results) {
  const sim::SystemSpec spec = stiff_cloth(n, registry);
  const auto simulation = [&](std::map<std::string, sim::Value> given) {
    given["tol"] = kResidual;
    return sim::Simulation(spec, registry, {.integrator = {"implicit_euler", given}, .dt = kStep});
  };
  sim::Simulation single = simulation({{"newton_steps", std::int64_t{1}},
                                       {"hessian", std::string("clamped")},
                                       {"solver", std::string("cg")}});
  sim::Simulation newton = simulation({});
  std::vector<std::string> names = {"kernel, one linearised step", "kernel, Newton's method"};
  std::vector<Contestant> contestants = {contestant(single), contestant(newton)};

  using Iterative = Eigen::ConjugateGradient<EigenStep::Matrix, Eigen::Lower | Eigen::Upper>;
  using Direct = Eigen::SimplicialLDLT<EigenStep::Matrix>;
  EigenStep one(single), two(single);
  Iterative cg;
  long solves = 0, iterations = 0;
  cg.setTolerance(kResidual);
  names.push_back("Eigen, ConjugateGradient");
  contestants.push_back(contestant_of(one, [&](const auto& a, const auto& b, auto& x) {
    x = cg.compute(a).solve(b);
    ++solves;
    iterations += cg.iterations();
  }));
  Direct ldlt;
  if (n <= kLargestFactor) {
    ldlt.analyzePattern(two.matrix());
    names.push_back("Eigen, SimplicialLDLT");
    contestants.push_back(contestant_of(two, [&](const auto& a, const auto& b, auto& x) {
      ldlt.factorize(a);
      x = ldlt.solve(b);
    }));
  }

  const std::vector<Times> times = measure(contestants, options.timing);
  const auto per_step = [](const sim::Simulation& s) {
    const sim::Effort effort = s.integrator().effort();
    return static_cast<double>(effort.linear) / static_cast<double>(effort.steps);
  };
  const double counts[] = {per_step(single), per_step(newton),
                           static_cast<double>(iterations) / static_cast<double>(solves), 0};
  for (std::size_t i = 0; i < times.size(); ++i)
    results.push_back({n, names[i], times[i], counts[i]});
}

}  // namespace

std::vector<ImplicitResult> measure_implicit(const Options& options, sim::Registry& registry) {
  std::vector<ImplicitResult> results;
  for (const int n : {8, 32, 128}) measure_size(n, options, registry, results);
  return results;
}

Table implicit_table(const std::vector<ImplicitResult>& results) {
  Table table("implicit", "Backward Euler on a stiff n x n cloth, one thread",
              {{"n", "n"},
               {"solver", "solver", false},
               {"us/step", "us_per_step"},
               {"min", "us_min"},
               {"max", "us_max"},
               {"iterations", "iterations_per_step"},
               {"x kernel", "times_kernel"}});
  double kernel = 1;
  for (const ImplicitResult& r : results) {
    if (r.solver.starts_with("kernel, one")) kernel = r.times.median;
    table.add({std::to_string(r.n), r.solver, short_number(r.times.median * 1e6),
               short_number(r.times.least * 1e6), short_number(r.times.most * 1e6),
               r.iterations > 0 ? short_number(r.iterations) : "",
               short_number(r.times.median / kernel)});
  }
  table.note(
      "h = 0.01 s, k = 1e5 N/m, 1 kg a particle, no drag; linear equations to 1e-6. Eigen: the "
      "same "
      "linearised step, assembled into a fixed pattern, with its default preconditioner, or with "
      "the "
      "symbolic factorisation made once. x kernel: time against the kernel's linearised step.");
  return table;
}

}  // namespace sim_bench
