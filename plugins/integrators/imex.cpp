// Implicit-explicit steps: implicit in stiff forces alone, explicit in the rest.
#include "core/base/error.h"
#include "core/ode/implicit/implicit.h"
#include "core/ode/integrator.h"
#include "core/ode/stability.h"
#include "core/plugin/plugin.h"

namespace {

// Without implicit stages it is verlet.
sim::ImplicitExplicitPlan plan_of(const sim::Params& params) {
  return {.soft = {.drift = {0, 1, 0}, .kick = {0.5, 0.5}, .order = 2},
          .stiff = {.tolerance = params.number("tol"), .order = 2, .reach = 2},
          .substeps = static_cast<int>(params.integer("substeps"))};
}

//  1/2 | 1/2
//  ----+-----
//      |  1
constexpr sim::Tableau<1> kMidpoint{.a = {{{0.5}}}, .b = {1}, .c = {0.5}};
static_assert(sim::order_conditions(kMidpoint) == 2);

class Imex final : public sim::Integrator {
 public:
  explicit Imex(const sim::Params& params) : plan_(plan_of(params)) {}

  sim::IntegratorInfo info() const noexcept override {
    return {.order = 2, .needs_second_order = true, .implicit = true};
  }

  void prepare(sim::OdeSystem& system) override {
    system_ = &system;
    stepper_ = system.implicit_explicit_stepper(plan_);
    midpoint_.reset();
    step_ = parted_ = 0;
    if (!stepper_)
      throw sim::Error(sim::ErrorKind::kScene,
                       {"integrator does not fit", "",
                        "imex needs q' = v, v' = a(t, q) - gamma v, and this system is of first "
                        "order or has a force that remembers what particles do",
                        "use trbdf2 or rk4"});
  }

  void set_step_size(double h) override { step_ = h; }

  // f is partitioned once, and again if the step of the run has grown or shrunk.
  void restart(double t, double h, const double* x) override {
    if (step_ == 0) step_ = h;
    if (parted_ != step_) {
      stepper_->choose_partition(t, step_, x);
      find_midpoint();
    }
    stepper_->restart();
    if (midpoint_) midpoint_->restart(t, h, x);
  }

  sim::Advance advance(sim::OdeSystem& system, double t, double h, std::int64_t most,
                       const double* x, double* x_next) override {
    if (midpoint_) return midpoint_->advance(system, t, h, most, x, x_next);
    return stepper_->advance(t, h, most, x, x_next);
  }

  // The partition, and the memory of the implicit midpoint rule.
  std::vector<double> memory() const override {
    std::vector<double> numbers = stepper_->memory();
    if (!midpoint_) return numbers;
    const std::vector<double> own = midpoint_->memory();
    numbers.insert(numbers.end(), own.begin(), own.end());
    return numbers;
  }
  void recall(std::span<const double> memory) override {
    const std::size_t size = std::min(memory.size(), stepper_->memory().size());
    if (!stepper_->recall(memory.first(size))) return;
    find_midpoint();
    if (midpoint_) midpoint_->recall(memory.subspan(size));
  }

  sim::Effort effort() const override {
    const sim::Effort own = stepper_->effort();
    return midpoint_ ? own + midpoint_->effort() : own;
  }
  std::vector<std::string> notes() const override { return stepper_->notes(); }

  // Unknown before f is partitioned.
  double amplification(double h_omega, double h_gamma) const override {
    if (parted_ == 0) return Integrator::amplification(h_omega, h_gamma);
    return sim::amplification(plan_.soft, h_omega, h_gamma);
  }
  sim::OdeSystem* limiting_part() const override {
    return stepper_ ? stepper_->soft_part() : nullptr;
  }

 private:
  // If all is stiff, the steps are those of the implicit midpoint rule, to the bit.
  void find_midpoint() {
    parted_ = step_;
    midpoint_.reset();
    if (!stepper_->is_all_stiff() || plan_.substeps > 1) return;
    midpoint_ = std::make_unique<sim::DiagonallyImplicit>(kMidpoint, 2, plan_.stiff, true);
    midpoint_->prepare(*system_);
  }

  sim::ImplicitExplicitPlan plan_;
  sim::OdeSystem* system_ = nullptr;
  std::unique_ptr<sim::ImplicitExplicitStepper> stepper_;
  std::unique_ptr<sim::DiagonallyImplicit> midpoint_;
  double step_ = 0, parted_ = 0;  // s: of the run, and for which f was partitioned
};

}  // namespace

SIM_PLUGIN(Integrator, "imex") {
  registrar.add(sim::IntegratorPlugin{
      {.name = "imex",
       .summary = "implicit in stiff forces alone, verlet in the rest: for a few stiff springs "
                  "among many soft ones",
       .formula = "v += h/2 a_soft(t, q)\n"
                  "stiff springs:  v_mid = v + h/2 a,  q_next = q + h v_mid,  v = 2 v_mid - v,\n"
                  "  m a = -k (1 - 2 rest / (|d| + |d_next|)) (d + d_next) / 2, which keeps their "
                  "energy;\n"
                  "  from h omega = 10 on what rings from step to step is damped\n"
                  "other stiff forces, or with contact:  implicit midpoint\n"
                  "v += h/2 a_soft(t + h, q)\n"
                  "a spring is stiff where k (1/m_a + 1/m_b) > cut^2, with the largest cut that "
                  "leaves a soft part\n"
                  "on which verlet is stable; stiff = true or false of a force says it",
       .source = "Stern & Grinspun (2009), Multiscale Model. Simul. 7(4), 1779-1794; Gonzalez "
                 "(1996), J. Nonlinear Sci. 6, 449-467",
       .params = {{.name = "tol",
                   .default_value = 0.0,
                   .doc = "residual of the equations at the end, relative to the one at the start; "
                          "0: small enough that the error of the method stays what it is",
                   .min = 0,
                   .max = 0.5},
                  {.name = "substeps",
                   .type = sim::ParamType::kInteger,
                   .default_value = std::int64_t{0},
                   .doc =
                       "equal implicit steps between two kicks; 0: one, or, by the midpoint rule, "
                       "so many that the fastest stiff spring has h omega <= 100 in each",
                   .min = 0,
                   .max = 1000}}},
      [](const sim::Params& params) { return std::make_unique<Imex>(params); }});
}
