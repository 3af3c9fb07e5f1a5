#include "core/ode/jacobian.h"

#include <algorithm>
#include <cmath>

#include "core/base/array.h"
#include "core/ode/jacobian_effort.h"
#include "core/ode/ode_system.h"

namespace sim {
namespace {

// J dx = (f(x + e dx) - f(x - e dx)) / 2e + O(e^2). Truncation and rounding balance where e dx is
// the cube root of the machine precision of x.
class DifferenceJacobian final : public Jacobian {
 public:
  explicit DifferenceJacobian(OdeSystem& system)
      : system_(&system), point_(system.size()), below_(system.size()) {}

  void at(double t, const double* x) override {
    t_ = t;
    x_ = x;
    size_of_x_ = largest(x);
  }

  void apply(const double* dx, double* df) override {
    constexpr double kCubeRootOfPrecision = 6e-6;
    const std::size_t n = system_->size();
    const double size = largest(dx);
    if (size == 0) {
      std::fill(df, df + n, 0.0);
      return;
    }
    const double e = kCubeRootOfPrecision * std::max(size_of_x_, 1e-3) / size;
    evaluate(-e, dx, below_.data());
    evaluate(e, dx, df);
    for (std::size_t i = 0; i < n; ++i) df[i] = (df[i] - below_[i]) / (2 * e);
  }

  std::int64_t evaluations() const { return evaluations_; }

 private:
  double largest(const double* values) const {
    double most = 0;
    for (std::size_t i = 0; i < system_->size(); ++i) most = std::max(most, std::abs(values[i]));
    return most;
  }

  void evaluate(double e, const double* dx, double* f) {
    const Stage::Term term{e, dx};
    system_->eval(t_, {x_, {&term, 1}}, point_.data(), f);
    ++evaluations_;
  }

  OdeSystem* system_;
  Array point_, below_;
  double t_ = 0, size_of_x_ = 0;
  std::int64_t evaluations_ = 0;
  const double* x_ = nullptr;
};

}  // namespace

std::unique_ptr<Jacobian> difference_jacobian(OdeSystem& system) {
  return std::make_unique<DifferenceJacobian>(system);
}

std::int64_t evaluations_of(const Jacobian& jacobian) {
  const auto* const differences = dynamic_cast<const DifferenceJacobian*>(&jacobian);
  return differences ? differences->evaluations() : 0;
}

}  // namespace sim
