// Evaluations of f that implicit methods report, counted by f itself.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/ode/integrator.h"
#include "core/ode/ode_system.h"
#include "core/plugin/registry.h"

using namespace sim;

namespace {

// A ring of n numbers that decay and drive each other.
class Counted final : public OdeSystem {
 public:
  explicit Counted(std::size_t n) : n_(n) {}
  std::size_t size() const noexcept override { return n_; }
  void eval(double, const Stage& stage, double* y, double* dydt) override {
    ++count;
    combine(stage, y);
    for (std::size_t i = 0; i < n_; ++i) dydt[i] = std::sin(y[(i + 1) % n_]) - 50 * y[i];
  }
  void combine(const Stage& stage, double* out) override {
    for (std::size_t i = 0; i < n_; ++i) {
      double sum = stage.x[i];
      for (const auto& term : stage.terms) sum += term.coef * term.k[i];
      out[i] = sum;
    }
  }

  std::int64_t count = 0;

 private:
  std::size_t n_;
};

}  // namespace

TEST_CASE("evaluations of implicit methods include those of a Jacobian by differences") {
  Registry registry({SIM_PLUGIN_DIR});
  int tried = 0;
  for (const std::string& name : registry.names<Integrator>()) {
    const IntegratorPlugin& plugin = registry.get<Integrator>(name);
    if (!plugin.make) continue;
    const auto integrator = Method(registry, MethodChoice(name)).make();
    if (!integrator->info().implicit || integrator->info().order == 0) continue;
    // A dense matrix, and products alone.
    for (const auto& [solver, size] :
         {std::pair("ldlt", std::size_t{7}), {"cg", std::size_t{700}}}) {
      INFO(name << ", " << solver);
      MethodChoice choice{name};
      for (const Param& param : plugin.params)
        if (param.name == "solver") choice.given["solver"] = std::string(solver);
      const auto method = Method(registry, choice).make();
      Counted system(size);
      try {
        method->prepare(system);
      } catch (const Error&) {  // it is for particles
        continue;
      }
      Array x(size), x_next(size);
      for (std::size_t i = 0; i < size; ++i) x[i] = 1.0 / (1.0 + static_cast<double>(i));
      method->restart(0, 0.02, x.data());
      system.count = 0;
      for (int step = 0; step < 5; ++step) {
        REQUIRE(method->step(system, 0.02 * step, 0.02, x.data(), x_next.data()) ==
                StepStatus::kDone);
        std::swap(x, x_next);
      }
      CHECK(method->effort().evaluations == system.count);
      ++tried;
    }
  }
  CHECK(tried >= 8);
}
