// Chooses a method and a step for a system, from the fastest mode of its Jacobian and the
// tolerance, and checks the choice during the run.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>

#include "core/base/array.h"
#include "core/base/finite.h"
#include "core/math/elementary.h"
#include "core/ode/fastest_mode.h"
#include "core/ode/stability.h"
#include "core/plugin/method.h"
#include "core/plugin/plugin.h"

namespace {

using Given = std::map<std::string, sim::Value>;

// Runs of springs at more than half their limit of stability pick up energy from resonances between
// modes: Skeel & Srinivas (2000), SIAM J. Numer. Anal. 38, 129-148.
constexpr double kShareOfLimit = 0.5;
// The h omega above which an implicit step of h is cheaper than the explicit ones in it; not so for
// an implicit method whose own steps shrink to a quarter of that.
constexpr double kStiffest = 200, kNotStiff = 50;
// The size of a list of numbers up to which an implicit step costs about as much as an explicit
// one: their Jacobian has few entries.
constexpr std::size_t kFewNumbers = 2000;
constexpr double kFlatStiffest = 10;
// Any method has to follow what grows nearly as fast as the fastest mode decays.
constexpr double kGrows = 0.3;
// Lists of so few numbers are worth a factorisation a step, down to this tolerance: below it the
// higher orders of bdf win. Explicit steps of them cost little beside the choice of their size, of
// which order 8 needs fewer.
constexpr std::size_t kSmall = 16;
constexpr double kLinear = 1e-6, kFewSteps = 3e-4;
constexpr int kShortSteps = 10;  // one after the other, until it is given up
// An implicit method of order 4 takes too many steps below this tolerance.
constexpr double kImplicit = 1e-10;
// Stiff systems have decisive numbers far below a tolerance that is one for all of them.
constexpr double kLoosest = 1e-5;
// A splitting with steps backwards in time multiplies rounding errors by e^(gamma h) in them.
constexpr double kMostDamping = 1;
// The h omega below which the fast motion of now tells nothing of later.
constexpr double kSlack = 1e-3;
constexpr std::int64_t kMostAtOnce = 64;
constexpr double kCoarse = 1e-3, kFine = 1e-7;
constexpr double kLook = 2000;  // evaluations from one look at the fastest mode to the next
// Explicit steps of small lists, in which a look costs little, are looked at earlier, as a list may
// become stiff at once; then later each time, up to kLook.
constexpr double kFirstLook = 500, kFewInStep = 100;
constexpr int kEarlyLooks = 2;
constexpr int kChoices = 16, kLooks = 4;  // room for them in a stored number
constexpr double kHold = 20;              // steps of h after implicit steps were given up

class Automatic final : public sim::Integrator {
 public:
  Automatic(const sim::Params& params, sim::OtherIntegrator other)
      : tol_(params.number(params.has("rtol") ? "rtol" : "tol")), other_(std::move(other)) {
    if (params.has("atol")) atol_ = params.number("atol");
  }

  sim::IntegratorInfo info() const noexcept override {
    return method_ ? method_->info() : sim::IntegratorInfo{};
  }

  void prepare(sim::OdeSystem& system) override {
    system_ = &system;
    for (auto& method : methods_) method.reset();
    method_ = nullptr;
    choice_ = kNone;
    splits_ = system.split_stepper({.drift = {0, 1}, .kick = {1}, .order = 4}) != nullptr;
    const sim::StateShape shape = system.shape();
    flat_ = shape.first().item == "component";
    for (sim::Array* array : {&between_, &coarse_, &half_, &fine_})
      *array = sim::Array(system.size());
  }

  void restart(double t, double h, const double* x) override {
    spent_ = hold_ = short_ = part_ = 0;
    looks_ = 0;
    many_ = true;
    choose(t, h, x);
    method_->restart(t, step_of(h), x);
  }

  sim::Advance advance(sim::OdeSystem& system, double t, double h, std::int64_t most,
                       const double* x, double* x_next) override {
    if (part_ == 0 && spent_ >= to_look()) look_again(t, h, x);
    if (system.gave_up()) return given_up();
    const sim::Effort before = method_->effort();
    const bool equal = !method_->info().adaptive;
    const sim::Advance now =
        equal ? equal_steps(system, t, h, most, x, x_next) : own_steps(system, t, h, x, x_next);
    if (now.status != sim::StepStatus::kDone) {
      const bool hard = now.status != sim::StepStatus::kStopped && is_explicit();
      if (!hard || tol_ < kImplicit || system.has_inequalities()) return now;
      // Explicit steps that fail within h may have met stiffness that was not there at its start.
      take(flat_ ? of_lists() : kStiff);
      part_ = 0;
      method_->restart(t, h, x);
      reason_ = "auto: " + name_ + ", steps of its own: explicit ones failed";
      return advance(system, t, h, most, x, x_next);
    }
    // The next check comes at the same time, however many equal steps were taken at once.
    if (equal) spent_ += static_cast<double>(now.taken) * cost_of(h);
    if (choice_ == kStiff) watch_steps(h, method_->effort().steps - before.steps);
    hold_ = std::max(0.0, hold_ - now.taken);
    return now;
  }

  // The choice depends on the start and the history of the run, so it is stored.
  std::vector<double> memory() const override {
    const int stored = choice_ + kChoices * (looks_ + (many_ ? kLooks : 0));
    std::vector<double> memory{static_cast<double>(stored), longest_, rate_, spent_, hold_, short_};
    const std::vector<double> inner = method_->memory();
    memory.insert(memory.end(), inner.begin(), inner.end());
    return memory;
  }

  // Accepts only numbers that it can have written itself.
  void recall(std::span<const double> memory) override {
    constexpr std::size_t kOwn = 6;
    if (memory.size() < kOwn) return;
    const double last = kChoices * 2 * kLooks - 1;
    const int stored = memory[0] >= 1 && memory[0] <= last ? static_cast<int>(memory[0]) : 0;
    const int choice = stored % kChoices;
    const bool known = choice != kNone && choice <= kRosenbrock && stored == memory[0] &&
                       (splits_ || (choice != kVerlet && choice != kPefrl)) &&
                       (flat_ || (choice != kMultistep && choice != kRosenbrock)) &&
                       (choice != kRosenbrock || of_lists() == kRosenbrock) &&
                       (!system_->is_changed_between_steps() || choice == kVerlet ||
                        choice == kPefrl || choice == kClassic);
    const bool lengths = memory[1] > 0;
    const auto counts = memory.subspan(2, 4);
    if (!known || !lengths || std::ranges::any_of(counts, [](double n) { return !(n >= 0); }))
      return;
    take(static_cast<Choice>(choice));
    looks_ = std::min(stored / kChoices % kLooks, kEarlyLooks);
    many_ = stored / kChoices >= kLooks;
    part_ = 0;
    longest_ = memory[1];
    rate_ = memory[2];
    spent_ = memory[3];
    hold_ = memory[4];
    short_ = memory[5];
    method_->recall(memory.subspan(kOwn));
  }

  sim::Effort effort() const override {
    sim::Effort sum;
    for (const auto& method : methods_)
      if (method) sum = sum + method->effort();
    return sum;
  }

  std::vector<std::string> notes() const override {
    std::vector<std::string> notes{reason_};
    if (method_)
      for (const std::string& note : method_->notes()) notes.push_back(note);
    return notes;
  }

 private:
  enum Choice {
    kNone,
    kVerlet,
    kPefrl,
    kAdaptive,
    kAccurate,
    kStiff,
    kClassic,
    kMultistep,
    kRosenbrock
  };

  std::int64_t steps_in(double h) const {
    constexpr double kMost = 1e15;
    return std::max<std::int64_t>(
        1, static_cast<std::int64_t>(std::min(kMost, std::ceil(h / longest_ - 1e-9))));
  }
  double step_of(double h) const { return h / static_cast<double>(steps_in(h)); }
  double cost_of(double h) const {  // evaluations of a step of h in equal steps
    return static_cast<double>(steps_in(h) * std::max(1, method_->info().evaluations));
  }

  bool is_explicit() const { return choice_ == kAdaptive || choice_ == kAccurate; }
  bool looks_early() const {
    return flat_ && system_->size() <= kSmall && is_explicit() && looks_ < kEarlyLooks;
  }
  // Evaluations from one look to the next.
  double to_look() const { return looks_early() ? std::ldexp(kFirstLook, looks_) : kLook; }

  // For stiff lists of numbers.
  Choice of_lists() const {
    return system_->size() <= kSmall && tol_ >= kLinear ? kRosenbrock : kMultistep;
  }

  // A method that was left is kept: systems go in and out of stiffness.
  void take(Choice choice) {
    if (choice == choice_) return;
    constexpr const char* kNames[] = {"",         "verlet", "pefrl", "dopri5", "dop853",
                                      "esdirk43", "rk4",    "bdf",   "rodas4"};
    std::unique_ptr<sim::Integrator>& method = methods_[choice];
    if (!method) {
      Given given;
      if (choice == kAdaptive || choice == kAccurate) given["tol"] = tol_;
      if (choice == kStiff || choice == kMultistep || choice == kRosenbrock)
        given["tol"] = atol_ ? tol_ : std::min(tol_, kLoosest);
      if (atol_ && given.contains("tol")) given["atol"] = *atol_;
      method = other_({kNames[choice], given});
      method->prepare(*system_);
    }
    method_ = method.get();
    name_ = kNames[choice];
    choice_ = choice;
  }

  // Implicit steps that shrink to where explicit ones are cheaper request another check.
  void watch_steps(double h, std::int64_t steps) {
    const bool shorter = steps > 1 && h / static_cast<double>(steps) * rate_ < kNotStiff;
    short_ = shorter ? short_ + static_cast<double>(steps) : 0;
    if (short_ >= kShortSteps) spent_ = kLook;
  }

  // The error of a step against two of half its size, relative to the tolerance: tol + tol |x| in
  // each number, as in adaptive methods. Infinity if one of them fails; `fine_` is the end.
  double error_of(sim::OdeSystem& system, double t, double h, const double* x,
                  sim::StepStatus& status) {
    status = sim::StepStatus::kDone;
    const auto step = [&](double from_t, double s, const double* from, sim::Array& to) {
      method_->restart(from_t, s, from);
      if (status == sim::StepStatus::kDone)
        status = method_->step(system, from_t, s, from, to.data());
    };
    step(t, h, x, coarse_);
    step(t, h / 2, x, half_);
    step(t + h / 2, h / 2, half_.data(), fine_);
    if (status != sim::StepStatus::kDone) return HUGE_VAL;
    const double gain = std::ldexp(1.0, method_->info().order) - 1;
    double most = 0;
    for (std::size_t i = 0; i < fine_.size(); ++i) {
      const double allowed = tol_ * (1 + std::max(std::fabs(x[i]), std::fabs(fine_[i])));
      const double error = std::fabs(fine_[i] - coarse_[i]) / gain / allowed;
      most = sim::larger_error(error, most);
    }
    return std::isnan(most) ? HUGE_VAL : most;
  }

  // Goes to the end of h in steps of the method's own. While looks are early, and unless the h
  // before took few evaluations, the states at 2^-12 h, 2^-11 h, .. are asked for, too: a list that
  // becomes stiff there would take any number of explicit steps to the end.
  sim::Advance own_steps(sim::OdeSystem& system, double t, double h, const double* x,
                         double* x_next) {
    constexpr double kFirstPart = 0x1p-12;
    const std::int64_t first = effort().evaluations;
    for (;;) {
      const double end = !(many_ && looks_early()) ? 1 : part_ > 0 ? 2 * part_ : kFirstPart;
      const std::int64_t before = method_->effort().evaluations;
      double* const to = end < 1 ? half_.data() : x_next;
      const sim::Advance now =
          method_->advance(system, t + part_ * h, end < 1 ? (end - part_) * h : h - part_ * h, 1,
                           part_ > 0 ? between_.data() : x, to);
      spent_ += static_cast<double>(method_->effort().evaluations - before);
      if (now.status != sim::StepStatus::kDone) {
        if (to != x_next) std::copy(to, to + half_.size(), x_next);
        return now;
      }
      part_ = end < 1 ? end : 0;
      if (end == 1) {
        many_ = static_cast<double>(effort().evaluations - first) > kFewInStep;
        return now;
      }
      std::swap(between_, half_);
      if (spent_ >= to_look()) look_again(t + end * h, h, between_.data());
      if (system.gave_up()) return given_up();
    }
  }

  // A look was cut short: the next one comes with the next step.
  sim::Advance given_up() {
    spent_ = kLook;
    longest_ = part_ = 0;
    return {sim::StepStatus::kStopped};
  }

  // Equal steps, of which the method may take more than requested: then as many as end at a
  // requested state.
  sim::Advance equal_steps(sim::OdeSystem& system, double t, double h, std::int64_t most,
                           const double* x, double* x_next) {
    const double inner = step_of(h);
    const std::int64_t each = steps_in(h);
    const auto to_look = static_cast<std::int64_t>(std::ceil((kLook - spent_) / cost_of(h)));
    const std::int64_t outer = std::clamp<std::int64_t>(to_look, 1, std::min(most, kMostAtOnce));
    std::int64_t goal = outer * each;
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
          return equal_steps(system, t, h, 1, x, x_next);
        if (to != x_next) std::copy(to, to + between_.size(), x_next);
        return now;
      }
      if (n == 0) goal = std::min(goal, (now.taken + each - 1) / each * each);
      n += now.taken;
      from = to;
      to = to == x_next ? between_.data() : x_next;
    }
    if (from != x_next) std::copy(from, from + between_.size(), x_next);
    return {sim::StepStatus::kDone, static_cast<int>(goal / each)};
  }

  // A method that stays chosen keeps its memory and step.
  void look_again(double t, double h, const double* x) {
    spent_ = 0;
    const Choice before = choice_;
    const double longest = longest_;
    if (choice_ == kStiff && short_ >= kShortSteps) hold_ = kHold;
    short_ = 0;
    choose(t, h, x);
    looks_ = choice_ == before ? std::min(looks_ + 1, kEarlyLooks) : 0;
    many_ = many_ || choice_ != before;
    if (choice_ != before || longest_ != longest) {
      method_->restart(t, step_of(h), x);
    }
  }

  void choose(double t, double h, const double* x) {
    const sim::FastestMode fastest = sim::fastest_mode(*system_, t, x);
    rate_ = fastest.rate;
    const bool oscillates = std::fabs(fastest.damping) < 1.9 * fastest.rate;
    const bool grows = fastest.growth > kGrows * fastest.rate;
    const bool decays = flat_ && !oscillates, few = decays && system_->size() <= kFewNumbers;
    std::string what = fastest.rate == 0 ? "nothing vibrates or decays"
                       : oscillates      ? "omega up to " + number(fastest.rate) + " rad/s"
                       : grows           ? "growth up to " + number(fastest.growth) + " 1/s"
                                         : "decay up to " + number(fastest.rate) + " 1/s";
    if (oscillates && fastest.rate > 0 && std::fabs(fastest.damping) > 1e-6 * fastest.rate)
      what += ", damping " + number(fastest.damping) + " 1/s";

    longest_ = h;
    const auto stay_below_limit = [&] {
      const double limit = sim::stable_step(*method_, fastest.rate, std::max(0.0, fastest.damping));
      longest_ = std::min(h, kShareOfLimit * limit);
      if (std::isfinite(limit)) what += ", stable up to " + number(limit) + " s";
    };
    const bool backwards = h * fastest.damping <= kMostDamping;
    const Choice equal = !splits_ ? kClassic : tol_ < kCoarse && backwards ? kPefrl : kVerlet;
    if (system_->has_inequalities()) {
      take(splits_ ? kVerlet : kClassic);
      what += ", not all states are allowed";
      stay_below_limit();
    } else if (system_->is_changed_between_steps()) {
      take(equal);
      what += ", contact acts between steps";
      stay_below_limit();
      shorten_for_accuracy(t, h, x, what);
    } else if (h * fastest.rate > (few ? kFlatStiffest : kStiffest) && tol_ >= kImplicit &&
               hold_ <= 0 && !(decays && grows)) {
      // Formulas of order 3 and more are unstable along a part of the imaginary axis.
      take(decays ? of_lists() : kStiff);
      what += ": explicit steps would be of " + number(1 / fastest.rate) +
              " s or less; its own steps to accuracy " + number(tol_);
    } else if (tol_ < kFine || !splits_ || h * fastest.rate < kSlack || hold_ > 0) {
      const bool accurate = tol_ < (flat_ && system_->size() <= kSmall ? kFewSteps : kFine);
      take(accurate ? kAccurate : kAdaptive);
      if (!splits_) what += ", first order or forces of velocity";
      what += ", accuracy " + number(tol_);
    } else {
      take(equal);
      stay_below_limit();
      shorten_for_accuracy(t, h, x, what);
    }
    reason_ = "auto: " + name_ +
              (steps_in(h) > 1 ? ", " + std::to_string(steps_in(h)) + " steps to each of "
                               : ", steps of ") +
              number(h) + " s: " + what;
  }

  // Equal steps whose error here is above the tolerance are made shorter.
  void shorten_for_accuracy(double t, double h, const double* x, std::string& what) {
    constexpr double kSafe = 0.9;
    const double s = step_of(h);
    sim::StepStatus status;
    const double error = error_of(*system_, t, s, x, status);
    if (!(error > 1) || std::isinf(error)) return;
    longest_ = s * kSafe * sim::power(error, -1 / (method_->info().order + 1.0));
    what += ", accuracy " + number(tol_);
  }
  static std::string number(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.3g", value);
    return text;
  }

  double tol_;
  std::optional<double> atol_;
  sim::OtherIntegrator other_;
  sim::OdeSystem* system_ = nullptr;
  bool splits_ = false;  // particles whose forces depend on positions and drag alone
  bool flat_ = false;    // a list of numbers, no points
  std::array<std::unique_ptr<sim::Integrator>, kRosenbrock + 1> methods_;  // made so far
  sim::Integrator* method_ = nullptr;                                      // of these
  Choice choice_ = kNone;
  std::string name_, reason_;
  double longest_ = 0;           // equal step of the method, s
  double rate_ = 0, short_ = 0;  // fastest mode, 1/s; short implicit steps
  double part_ = 0;              // of the present step of h, up to the state between_
  int looks_ = 0;                // early ones, since the choice
  bool many_ = true;             // evaluations in the last step of h, as far as is known
  double spent_ = 0, hold_ = 0;  // evaluations since a look; steps without implicit ones
  sim::Array between_, coarse_, half_, fine_;
};

}  // namespace

SIM_PLUGIN(Integrator, "auto") {
  sim::IntegratorPlugin plugin;
  plugin.name = "auto";
  plugin.summary = "chooses method and step for the scene, looks again as it goes, and says why";
  plugin.formula =
      "omega, gamma: of the fastest mode, at the start and every 2000 evaluations;\n"
      "              after 500 and 1000 for explicit steps of at most 16 numbers\n"
      "colliders:                verlet; rk4 with forces of velocity\n"
      "contact between steps:    verlet, pefrl as below; rk4 with forces of velocity\n"
      "stiff (h omega > 200):    esdirk43 to tol, or 1e-5 where tol is more,\n"
      "                          until its steps come below 50 / omega\n"
      "lists of numbers whose fastest mode decays, nothing grows nearly as fast, stiff,\n"
      "or few and h omega > 10:  bdf to tol, or 1e-5 where tol is more and no atol given;\n"
      "  16 or fewer, tol >= 1e-6: rodas4 likewise\n"
      "particles, forces of positions and drag:\n"
      "  tol >= 1e-3:            verlet\n"
      "  tol >= 1e-7:            pefrl; verlet where h gamma > 1\n"
      "  in steps of at most h, half of the stable one, and an error of tol\n"
      "first order, other forces of velocity, nothing fast yet: dopri5 to tol\n"
      "tol < 1e-7, or 3e-4 of 16 numbers or fewer: dop853 to tol\n"
      "tol is held in each step, not over the run: the verdict measures that.\n"
      "A run without tol and step is that of --error 0.1%; this where trials tell nothing.";
  plugin.params = {
      {.name = "tol",
       .default_value = 1e-5,
       .doc = "accuracy of a step: tol + tol |x| in each number",
       .min = 1e-14,
       .max = 1},
      {.name = "atol",
       .doc = "the absolute one, of methods with steps of their own; tol if not given",
       .min = 1e-300},
      {.name = "rtol", .doc = "the relative one; tol if not given", .min = 1e-14, .max = 1}};
  plugin.make_from_others = [](const sim::Params& params, const sim::OtherIntegrator& other) {
    return std::make_unique<Automatic>(params, other);
  };
  registrar.add(std::move(plugin));
}
