#include "stage_linear_solver.h"

#include <algorithm>
#include <iterator>

#include "block_multigrid.h"
#include "core/base/error.h"
#include "multigrid.h"

namespace sim {
namespace {

constexpr int kDirectUpTo = 8;     // particles; more are faster with conjugate gradients
constexpr int kDirectAtAll = 512;  // particles whose factor may stand by: more take long to analyse
constexpr int kPatience = 500;     // iterations until the factor is faster, whatever the size
constexpr double kStiff = 300;     // stiffness of A from which on factors precondition GMRES
// The largest numbers of products of a factorisation kept as a fallback, and of one for steps in
// which everything is stiff.
constexpr double kProductsStandingBy = 2e10, kProductsOfLongSteps = 1e11;

std::unique_ptr<SparseLdlt> make_factor_of_springs(const StageMatrix& matrix,
                                                   const Particles& system) {
  const auto pairs = matrix.fixed_pairs();
  return std::make_unique<SparseLdlt>(matrix, pairs, elimination_rows(system.masses(), pairs));
}

// Conjugate gradients, with the factorisation as a fallback if they do not converge.
class Either final : public LinearSolver {
 public:
  Either(StageMatrix& matrix, const Particles& system)
      : iterative_(matrix, kPatience), direct_(make_factor_of_springs(matrix, system)) {}

  LinearResult solve(const double* b, double* d, double eta) override {
    const LinearResult first = iterative_.solve(b, d, eta);
    if (!first.definite || first.solved) return first;
    LinearResult second = direct_->solve(b, d, eta);
    second.iterations = first.iterations;
    return second;
  }
  bool prepare() override { return direct_->prepare(); }
  void divide(const double* r, double* z) override { direct_->divide(r, z); }

 private:
  ConjugateGradient iterative_;
  std::unique_ptr<SparseLdlt> direct_;
};

// Conjugate gradients with the block-diagonal preconditioner alone if inequality constraints
// restrict the matrix: neither multigrid nor the factors include them.
class Restricted final : public LinearSolver {
 public:
  Restricted(BlockMatrix& matrix, int most, std::unique_ptr<LinearSolver> whole)
      : matrix_(&matrix), iterative_(matrix, most), whole_(std::move(whole)) {}

  LinearResult solve(const double* b, double* d, double eta) override {
    return matrix_->restricted() ? iterative_.solve(b, d, eta) : whole_->solve(b, d, eta);
  }
  bool prepare() override { return !matrix_->restricted() && whole_->prepare(); }
  void divide(const double* r, double* z) override { whole_->divide(r, z); }
  bool divides_cheaply() const override { return whole_->divides_cheaply(); }

 private:
  const BlockMatrix* matrix_;
  ConjugateGradient iterative_;
  std::unique_ptr<LinearSolver> whole_;
};

std::unique_ptr<LinearSolver> make_unrestricted(StageMatrix& matrix, const Particles& system,
                                                const StageOptions& options, int most) {
  using Solver = StageOptions::Solver;
  const int n = matrix.layout().n();
  const bool small = n <= kDirectUpTo;
  if (options.solver == Solver::kDirect || (options.solver == Solver::kAuto && small))
    return make_factor_of_springs(matrix, system);
  if (options.solver == Solver::kAuto && n <= kDirectAtAll)
    return std::make_unique<Either>(matrix, system);
  return std::make_unique<ConjugateGradient>(matrix, most,
                                             std::make_unique<Multigrid>(matrix, system));
}

std::unique_ptr<LinearSolver> make_unsymmetric(StageMatrix& matrix, const Particles& system,
                                               const StageOptions& options, int most) {
  using Solver = StageOptions::Solver;
  const bool demanded = options.solver == Solver::kDirect;
  auto pairs = matrix.others().couplings();
  if (!pairs && demanded)
    throw Error(ErrorKind::kScene,
                {"integrator does not fit", "",
                 "the sparse factorisation is for forces that always couple the same particles, "
                 "and this system has another, '" +
                     system.name_of(*system.other_forces().front()) + "'",
                 "use solver = \"auto\""});
  const double affordable = options.long_steps ? kProductsOfLongSteps : kProductsStandingBy;
  std::unique_ptr<Preconditioner> better;
  if (pairs) {
    std::ranges::copy(matrix.fixed_pairs(), std::back_inserter(*pairs));
    if (options.solver != Solver::kIterative) {
      auto rows = elimination_rows(system.masses(), *pairs);
      if (demanded || factor_products(rows, *pairs) <= affordable)
        better = std::make_unique<SparseLdlt>(matrix, *pairs, std::move(rows));
    }
    if (!better) better = std::make_unique<BlockMultigrid>(matrix, system, *pairs);
  }
  const bool always = better && better->factorises() && (demanded || options.long_steps);
  const bool symmetric = std::ranges::all_of(system.other_forces(), [](const Force* force) {
    return force->conservative() && !force->depends_on_velocity();
  });
  return std::make_unique<Gmres>(matrix, most, std::move(better), always ? 0 : kStiff, symmetric);
}

}  // namespace

std::unique_ptr<LinearSolver> make_linear_solver(StageMatrix& matrix, const Particles& system,
                                                 const StageOptions& options, bool bounded) {
  // In exact arithmetic as many iterations as unknowns would do.
  const int most = 100 + 6 * matrix.layout().n();
  if (!matrix.symmetric()) return make_unsymmetric(matrix, system, options, most);
  auto solver = make_unrestricted(matrix, system, options, most);
  if (!bounded) return solver;
  return std::make_unique<Restricted>(matrix, most, std::move(solver));
}

}  // namespace sim
