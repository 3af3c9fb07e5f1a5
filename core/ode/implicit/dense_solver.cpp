#include "core/ode/implicit/dense_solver.h"

#include <Eigen/LU>
#include <algorithm>
#include <string>

#include "core/base/error.h"
#include "core/ode/implicit/jacobian_entries.h"

namespace sim {
namespace {

Eigen::Map<Eigen::VectorXd> vector(Array& array, std::size_t size) {
  return {array.data(), static_cast<Eigen::Index>(size)};
}

}  // namespace

struct DenseSolver::Matrices {
  explicit Matrices(Eigen::Index n)
      : a(Eigen::MatrixXd::Zero(n, n)), lu(n), x(Eigen::VectorXd::Zero(n)) {}
  Eigen::MatrixXd a;
  Eigen::PartialPivLU<Eigen::MatrixXd> lu;
  Eigen::VectorXd x;
};

DenseSolver::DenseSolver(OdeSystem& system, const StageOptions& options)
    : StageNewton(system, options), unit_(size()) {
  if (size() > kMostNumbers)
    throw Error(
        ErrorKind::kScene,
        {"integrator does not fit", "",
         "an implicit method would need a dense matrix for the " + std::to_string(size()) +
             " numbers of this state; at most " + std::to_string(kMostNumbers) + " are allowed",
         "use rk4"});
  matrices_ = std::make_unique<Matrices>(static_cast<Eigen::Index>(size()));
}

DenseSolver::~DenseSolver() = default;

void DenseSolver::linearise(double t, double tau, const double* y) {
  jacobian().at(t, y);
  jacobian_columns(jacobian(), unit_.span(), {matrices_->a.data(), size() * size()});
  matrices_->a *= -tau;
  matrices_->a.diagonal().array() += 1;
  matrices_->lu.compute(matrices_->a);
  ++effort_.factorisations;
}

bool DenseSolver::divide(Array& x) {
  matrices_->x = matrices_->lu.solve(vector(x, size()));
  std::copy_n(matrices_->x.data(), size(), x.data());
  return true;
}

}  // namespace sim
