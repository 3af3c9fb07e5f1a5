// Chooses a method and a step for the system it is given, from the fastest mode of its Jacobian.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/base/array.h"
#include "core/ode/fastest_mode.h"
#include "core/ode/stability.h"
#include "core/plugin/plugin.h"

namespace {

using Given = std::map<std::string, sim::Value>;

// Runs of springs at more than half their limit of stability pick up energy from resonances between
// modes: Skeel & Srinivas (2000), SIAM J. Numer. Anal. 38, 129-148.
constexpr double kShareOfLimit = 0.5;
// Where h omega is more than this an implicit step of h is cheaper than the explicit ones in it,
// and what it damps away moves too fast to be seen.
constexpr double kStiffest = 200;
// A splitting with steps backwards in time multiplies rounding errors by e^(gamma h) in them.
constexpr double kMostDamping = 1;
constexpr std::int64_t kMostAtOnce = 64;
constexpr double kCoarse = 1e-3, kFine = 1e-7;

class Automatic final : public sim::Integrator {
 public:
  Automatic(const sim::Params& params, sim::OtherIntegrator other)
      : tol_(params.number("tol")), other_(std::move(other)) {}

  sim::IntegratorInfo info() const noexcept override {
    return method_ ? method_->info() : sim::IntegratorInfo{};
  }

  void prepare(sim::OdeSystem& system) override {
    system_ = &system;
    splits_ = system.split_stepper({.drift = {0, 1}, .kick = {1}, .order = 4}) != nullptr;
  }

  void restart(double t, double h, const double* x) override {
    const sim::FastestMode fastest = sim::fastest_mode(*system_, t, x);
    choose(h, fastest);
    method_->restart(t, step_of(h), x);
  }

  // Equal steps of its own, of which the method may take more than were asked for: then as many as
  // end where a state is wanted.
  sim::Advance advance(sim::OdeSystem& system, double t, double h, std::int64_t most,
                       const double* x, double* x_next) override {
    const double inner = step_of(h);
    const std::int64_t each = steps_in(h);
    std::int64_t goal = most > kMostAtOnce ? kMostAtOnce * each : most * each;
    const double* from = x;
    double* to = x_next;
    for (std::int64_t n = 0; n < goal;) {
      const sim::Advance now = n > 0 && system.stopped()
                                   ? sim::Advance{sim::StepStatus::kStopped}
                                   : method_->advance(system, t + static_cast<double>(n) * inner,
                                                      inner, goal - n, from, to);
      if (now.status != sim::StepStatus::kDone) {
        if (n > 0) method_->restart(t, inner, x);  // of the state before
        if (goal > each && now.status != sim::StepStatus::kStopped)
          return advance(system, t, h, 1, x, x_next);
        if (to != x_next) std::copy(to, to + between_.size(), x_next);
        return now;
      }
      if (n == 0) goal = (now.taken + each - 1) / each * each;
      n += now.taken;
      from = to;
      to = to == x_next ? between_.data() : x_next;
    }
    if (from != x_next) std::copy(from, from + between_.size(), x_next);
    return {sim::StepStatus::kDone, static_cast<int>(goal / each)};
  }

  // The choice depends on where the run was started, so it is part of what has to be kept.
  std::vector<double> memory() const override {
    std::vector<double> memory{static_cast<double>(choice_), longest_};
    const std::vector<double> inner = method_->memory();
    memory.insert(memory.end(), inner.begin(), inner.end());
    return memory;
  }

  void recall(std::span<const double> memory) override {
    take(static_cast<Choice>(memory[0]));
    longest_ = memory[1];
    method_->recall(memory.subspan(2));
  }

  sim::Effort effort() const override { return method_ ? method_->effort() : sim::Effort{}; }
  std::vector<std::string> notes() const override {
    std::vector<std::string> notes{reason_};
    if (method_)
      for (const std::string& note : method_->notes()) notes.push_back(note);
    return notes;
  }

 private:
  enum Choice { kNone, kVerlet, kPefrl, kAdaptive, kAccurate, kStiff, kClassic };

  std::int64_t steps_in(double h) const {
    return std::max<std::int64_t>(1, static_cast<std::int64_t>(std::ceil(h / longest_ - 1e-9)));
  }
  double step_of(double h) const { return h / static_cast<double>(steps_in(h)); }

  void take(Choice choice) {
    if (choice == choice_) return;
    constexpr const char* kNames[] = {"", "verlet", "pefrl", "dopri5", "dop853", "trbdf2", "rk4"};
    Given given;
    if (choice == kAdaptive || choice == kAccurate) given["tol"] = tol_;
    method_ = other_({kNames[choice], given});
    method_->prepare(*system_);
    name_ = kNames[choice];
    choice_ = choice;
    between_ = sim::Array(system_->size());
  }

  void choose(double h, const sim::FastestMode& fastest) {
    const auto number = [](double value) {
      char text[32];
      std::snprintf(text, sizeof text, "%.3g", value);
      return std::string(text);
    };
    const bool oscillates = std::fabs(fastest.damping) < 1.9 * fastest.rate;
    std::string what = fastest.rate == 0 ? "nothing vibrates or decays"
                       : oscillates      ? "omega up to " + number(fastest.rate) + " rad/s"
                                         : "decay up to " + number(fastest.rate) + " 1/s";
    if (oscillates && fastest.rate > 0 && std::fabs(fastest.damping) > 1e-6 * fastest.rate)
      what += ", damping " + number(fastest.damping) + " 1/s";

    longest_ = h;
    const auto stay_below_limit = [&] {
      const double limit = sim::stable_step(*method_, fastest.rate, std::max(0.0, fastest.damping));
      longest_ = std::min(h, kShareOfLimit * limit);
      if (std::isfinite(limit)) what += ", stable up to " + number(limit) + " s";
    };
    if (system_->confined()) {
      take(splits_ ? kVerlet : kClassic);
      what += ", colliders";
      stay_below_limit();
    } else if (h * fastest.rate > kStiffest) {
      take(kStiff);
      what += ": explicit steps would be of " + number(1 / fastest.rate) + " s or less";
    } else if (tol_ < kFine || !splits_) {
      take(tol_ < kFine ? kAccurate : kAdaptive);
      what += splits_ ? ", accuracy " : ", first order or forces of velocity, accuracy ";
      what += number(tol_);
    } else {
      const bool backwards = h * fastest.damping <= kMostDamping;
      take(tol_ < kCoarse && backwards ? kPefrl : kVerlet);
      stay_below_limit();
    }
    reason_ = "auto: " + name_ +
              (steps_in(h) > 1 ? ", " + std::to_string(steps_in(h)) + " steps to each of "
                               : ", steps of ") +
              number(h) + " s: " + what;
  }

  double tol_;
  sim::OtherIntegrator other_;
  sim::OdeSystem* system_ = nullptr;
  bool splits_ = false;  // particles whose forces depend on positions and drag alone
  std::unique_ptr<sim::Integrator> method_;
  Choice choice_ = kNone;
  std::string name_, reason_;
  double longest_ = 0;  // step of the method, s
  sim::Array between_;
};

}  // namespace

SIM_PLUGIN(Integrator, "auto") {
  sim::IntegratorPlugin plugin;
  plugin.name = "auto";
  plugin.summary = "chooses method and step for the scene, and says why";
  plugin.formula =
      "omega, gamma: of the fastest mode at the start\n"
      "colliders:                verlet; rk4 with forces of velocity\n"
      "stiff (h omega > 200):    trbdf2 in steps of h\n"
      "particles, forces of positions and drag:\n"
      "  tol >= 1e-3:            verlet\n"
      "  tol >= 1e-7:            pefrl; verlet where h gamma > 1\n"
      "  in steps of at most h and half of the stable one\n"
      "first order, other forces of velocity: dopri5 to tol\n"
      "tol < 1e-7:               dop853 to tol\n"
      "Nothing measures the error of the run: sim tradeoff does.";
  plugin.params = {{.name = "tol",
                    .default_value = 1e-5,
                    .doc = "accuracy wished for, relative",
                    .min = 1e-14,
                    .max = 1}};
  plugin.make_from_others = [](const sim::Params& params, const sim::OtherIntegrator& other) {
    return std::make_unique<Automatic>(params, other);
  };
  registrar.add(std::move(plugin));
}
