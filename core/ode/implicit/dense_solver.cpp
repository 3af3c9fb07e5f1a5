#include "core/ode/implicit/dense_solver.h"

#include <Eigen/LU>
#include <algorithm>
#include <string>

#include "core/base/error.h"
#include "core/ode/implicit/jacobian_entries.h"

namespace sim {

struct DenseSolver::Matrices {
  explicit Matrices(Eigen::Index n)
      : a(Eigen::MatrixXd::Zero(n, n)), lu(n), b(Eigen::VectorXd::Zero(n)), x(b) {}
  Eigen::MatrixXd a;
  Eigen::PartialPivLU<Eigen::MatrixXd> lu;
  Eigen::VectorXd b, x;
};

DenseSolver::DenseSolver(OdeSystem& system, const StageOptions& options)
    : StageNewton(system, options), columns_(system.shape()) {
  if (size() > kMostNumbers)
    throw Error(
        ErrorKind::kScene,
        {"integrator does not fit", "",
         "an implicit method would need a dense matrix for the " + std::to_string(size()) +
             " numbers of this state; at most " + std::to_string(kMostNumbers) + " are allowed",
         "use rk4"});
  matrices_ = std::make_unique<Matrices>(static_cast<Eigen::Index>(columns_.places().size()));
}

DenseSolver::~DenseSolver() = default;

void DenseSolver::linearise(double t, double tau, const double* y) {
  jacobian().at(t, y);
  Eigen::MatrixXd& a = matrices_->a;
  columns_.write(jacobian(), {a.data(), static_cast<std::size_t>(a.size())});
  a *= -tau;
  a.diagonal().array() += 1;
  matrices_->lu.compute(a);
  ++effort_.factorisations;
}

bool DenseSolver::divide(Array& x) {
  const std::span<const std::size_t> places = columns_.places();
  for (std::size_t k = 0; k < places.size(); ++k)
    matrices_->b[static_cast<Eigen::Index>(k)] = x[places[k]];
  matrices_->x = matrices_->lu.solve(matrices_->b);
  for (std::size_t k = 0; k < places.size(); ++k)
    x[places[k]] = matrices_->x[static_cast<Eigen::Index>(k)];
  return true;
}

}  // namespace sim
