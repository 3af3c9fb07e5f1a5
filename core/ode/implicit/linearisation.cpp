#include "core/ode/implicit/linearisation.h"

#include <utility>

#include "core/base/array.h"
#include "core/ode/implicit/matrix_solver.h"

namespace sim {
namespace {

class Linearisation final : public LinearisedSolver {
 public:
  explicit Linearisation(std::unique_ptr<JacobianEntries> entries)
      : entries_(std::move(entries)),
        matrix_(make_matrix_solver(entries_->sparsity())),
        values_(entries_->sparsity().count()) {}

  void linearise(double t, const double* x) override { entries_->at(t, x, values_.span()); }
  bool factorise(double tau) override {
    ++factorisations_;
    return matrix_->factorise(tau, values_.span());
  }
  void solve(double* x) override { matrix_->solve(x); }
  Effort effort() const override {
    return {.evaluations = entries_->evaluations(), .factorisations = factorisations_};
  }

 private:
  std::unique_ptr<JacobianEntries> entries_;
  std::unique_ptr<MatrixSolver> matrix_;
  Array values_;
  std::int64_t factorisations_ = 0;
};

}  // namespace

std::unique_ptr<LinearisedSolver> make_linearised_solver(std::unique_ptr<JacobianEntries> entries) {
  return std::make_unique<Linearisation>(std::move(entries));
}

}  // namespace sim
