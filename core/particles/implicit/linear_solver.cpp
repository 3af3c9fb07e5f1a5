#include "core/particles/implicit/linear_solver.h"

#include <algorithm>
#include <iterator>

#include "core/base/error.h"

namespace sim {
namespace {

constexpr int kDirectUpTo = 8;     // particles; more are faster with conjugate gradients
constexpr int kDirectAtAll = 512;  // particles whose factor may stand by: more take long to analyse
constexpr int kPatience = 500;     // iterations until the factor is faster, whatever the size
constexpr double kStiff = 300;     // stiffness of A from which on factors precondition GMRES
// The largest numbers of products of a factorisation kept as a fallback, and of one for steps in
// which everything is stiff.
constexpr double kProductsStandingBy = 1e8, kProductsOfLongSteps = 1e11;

std::vector<std::array<int, 2>> spring_pairs(const StageMatrix& matrix) {
  std::vector<std::array<int, 2>> pairs;
  matrix.stiffness().for_each([&](int a, int b, SpringStiffness) { pairs.push_back({a, b}); });
  return pairs;
}

std::unique_ptr<SparseLdlt> make_factor_of_springs(const StageMatrix& matrix,
                                                   const Particles& system) {
  const auto pairs = spring_pairs(matrix);
  return std::make_unique<SparseLdlt>(matrix, pairs, elimination_rows(system.masses(), pairs));
}

// Conjugate gradients, with the factorisation as a fallback if they do not converge.
class Either final : public LinearSolver {
 public:
  Either(const StageMatrix& matrix, const Particles& system)
      : iterative_(matrix.layout(), kPatience), direct_(make_factor_of_springs(matrix, system)) {}

  LinearResult solve(StageMatrix& matrix, const double* b, double* d, double eta) override {
    const LinearResult first = iterative_.solve(matrix, b, d, eta);
    if (!first.definite || first.solved) return first;
    LinearResult second = direct_->solve(matrix, b, d, eta);
    second.iterations = first.iterations;
    return second;
  }
  bool prepare(const StageMatrix& matrix) override { return direct_->prepare(matrix); }
  void divide(const double* r, double* z) override { direct_->divide(r, z); }

 private:
  ConjugateGradient iterative_;
  std::unique_ptr<SparseLdlt> direct_;
};

// Conjugate gradients with the block-diagonal preconditioner alone if inequality constraints
// restrict the matrix: neither multigrid nor the factors include them.
class Restricted final : public LinearSolver {
 public:
  Restricted(const StageMatrix& matrix, int most, std::unique_ptr<LinearSolver> whole)
      : iterative_(matrix.layout(), most), whole_(std::move(whole)) {}

  LinearResult solve(StageMatrix& matrix, const double* b, double* d, double eta) override {
    return matrix.restricted() ? iterative_.solve(matrix, b, d, eta)
                               : whole_->solve(matrix, b, d, eta);
  }
  bool prepare(const StageMatrix& matrix) override {
    return !matrix.restricted() && whole_->prepare(matrix);
  }
  void divide(const double* r, double* z) override { whole_->divide(r, z); }
  bool divides_cheaply() const override { return whole_->divides_cheaply(); }

 private:
  ConjugateGradient iterative_;
  std::unique_ptr<LinearSolver> whole_;
};

std::unique_ptr<LinearSolver> make_unrestricted(const StageMatrix& matrix, const Particles& system,
                                                const StageOptions& options, int most) {
  using Solver = StageOptions::Solver;
  const Layout& layout = matrix.layout();
  const bool small = layout.n() <= kDirectUpTo;
  if (options.solver == Solver::kDirect || (options.solver == Solver::kAuto && small))
    return make_factor_of_springs(matrix, system);
  if (options.solver == Solver::kAuto && layout.n() <= kDirectAtAll)
    return std::make_unique<Either>(matrix, system);
  return std::make_unique<ConjugateGradient>(matrix, system, most);
}

std::unique_ptr<LinearSolver> make_unsymmetric(const StageMatrix& matrix, const Particles& system,
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
  std::unique_ptr<SparseLdlt> factors;
  if (pairs && options.solver != Solver::kIterative) {
    std::ranges::copy(spring_pairs(matrix), std::back_inserter(*pairs));
    auto rows = elimination_rows(system.masses(), *pairs);
    if (demanded || factor_products(rows, *pairs) <= affordable)
      factors = std::make_unique<SparseLdlt>(matrix, *pairs, std::move(rows));
  }
  return std::make_unique<Gmres>(matrix.layout(), most, std::move(factors),
                                 demanded || options.long_steps ? 0 : kStiff);
}

}  // namespace

std::unique_ptr<LinearSolver> make_linear_solver(const StageMatrix& matrix, const Particles& system,
                                                 const StageOptions& options, bool bounded) {
  // In exact arithmetic as many iterations as unknowns would do.
  const Layout& layout = matrix.layout();
  const int most = 100 + 6 * layout.n();
  if (!matrix.symmetric()) return make_unsymmetric(matrix, system, options, most);
  auto solver = make_unrestricted(matrix, system, options, most);
  if (!bounded) return solver;
  return std::make_unique<Restricted>(matrix, most, std::move(solver));
}

}  // namespace sim
