// Choices of `auto`: with methods that only write down what they are asked for, on systems whose
// fastest mode is known.
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <vector>

#include "core/base/slot.h"
#include "core/ode/integrator.h"
#include "tests/support/scenes.h"

using namespace sim;
using Catch::Contains;

namespace {

class Idle final : public Stepper {
 public:
  bool step(double, double, int, const double*, double*) override { return true; }
};

// x' = J x with J = -gamma / 2 + omega turns in pairs of numbers, or -rate of each.
class Modes final : public OdeSystem {
 public:
  explicit Modes(std::size_t n, bool flat = true) : flat_(flat), n_(n) {}

  std::size_t size() const noexcept override { return n_; }
  StateShape shape() const override {
    return flat_ ? StateShape::flat(n_) : StateShape::points(n_ / 3);
  }
  void eval(double, const Stage& stage, double* y, double* dydt) override {
    combine(stage, y);
    product(y, dydt);
  }
  void combine(const Stage& stage, double* out) override {
    for (std::size_t i = 0; i < n_; ++i) {
      double sum = stage.x[i];
      for (const auto& term : stage.terms) sum += term.coef * term.k[i];
      out[i] = sum;
    }
  }
  std::unique_ptr<Stepper> split_stepper(const SplitPlan&) override {
    return splits ? std::make_unique<Idle>() : nullptr;
  }
  bool has_inequalities() const noexcept override { return obstacles; }
  std::unique_ptr<Jacobian> jacobian() override { return std::make_unique<Product>(*this); }

  double omega = 0, gamma = 0, decay = 0;  // 1/s
  bool splits = false, obstacles = false;

 private:
  struct Product final : Jacobian {
    explicit Product(const Modes& system) : of(system) {}
    void at(double, const double*) override {}
    void apply(const double* dx, double* df) override { of.product(dx, df); }
    const Modes& of;
  };
  void product(const double* x, double* out) const {
    for (std::size_t i = 0; i < n_; ++i) {
      const std::size_t other = i ^ 1u;
      const double turn = other < n_ ? (i < other ? -omega : omega) * x[other] : 0;
      out[i] = -(decay + 0.5 * gamma) * x[i] + turn;
    }
  }
  bool flat_;
  std::size_t n_;
};

// Requests, in their order.
struct Asked {
  std::vector<MethodChoice> methods;  // that were made
  std::string now;                    // the one that was restarted last
  std::vector<double> begins, steps;  // s, of steps alone
  std::vector<std::int64_t> most;     // of them, at once
  std::vector<double> restarts;       // s, sizes that were announced
};

struct Behaviour {
  StepStatus status = StepStatus::kDone;  // of methods with steps of their own, but for esdirk43
  std::int64_t own_steps = 1, evaluations = 0, at_once = 1;
  double fails_at = HUGE_VAL;  // s: equal steps that go beyond it fail
  double error = 0;            // of equal steps, m/s^3: x grows by error h^3
};

class Noted final : public Integrator {
 public:
  Noted(std::string name, Asked& asked, const Behaviour& behaviour)
      : name_(std::move(name)), asked_(asked), does_(behaviour) {}
  IntegratorInfo info() const noexcept override {
    const bool equal = name_ == "verlet" || name_ == "pefrl" || name_ == "rk4";
    return {.order = name_ == "verlet" ? 2 : 4, .evaluations = equal ? 4 : 0, .adaptive = !equal};
  }
  void prepare(OdeSystem& system) override { size_ = system.size(); }
  void restart(double, double h, const double*) override {
    asked_.now = name_;
    asked_.restarts.push_back(h);
  }
  Advance advance(OdeSystem&, double t, double h, std::int64_t most, const double* x,
                  double* x_next) override {
    asked_.most.push_back(most);
    asked_.begins.push_back(t);
    asked_.steps.push_back(h);
    for (std::size_t i = 0; i < size_; ++i) x_next[i] = x[i] + does_.error * h * h * h;
    if (t + h * static_cast<double>(std::min(most, does_.at_once)) > does_.fails_at + 1e-9)
      return {StepStatus::kNotFinite};
    if (info().adaptive && name_ != "esdirk43" && does_.status != StepStatus::kDone)
      return {does_.status};
    done_.steps += does_.own_steps;
    done_.evaluations += does_.evaluations;
    return {StepStatus::kDone, static_cast<int>(std::min(most, does_.at_once))};
  }
  Effort effort() const override { return done_; }
  std::vector<double> memory() const override { return {42}; }
  // Stable up to h omega = 2 and h gamma = 2.
  double amplification(double h_omega, double h_gamma) const override {
    return h_omega <= 2 && h_gamma <= 2 ? 1 : 2;
  }

 private:
  std::string name_;
  Asked& asked_;
  const Behaviour& does_;
  std::size_t size_ = 0;
  Effort done_;
};

// auto on a system, from x = 0.
struct Trial {
  Registry registry = sim_test::make_registry();
  Asked asked;
  Behaviour behaviour;
  Modes* system;
  std::unique_ptr<Integrator> method;
  Array x, next;
  double t = 0;

  Trial(Modes& of, double h, std::map<std::string, Value> given = {})
      : system(&of), x(of.size()), next(of.size()) {
    const IntegratorPlugin& plugin = registry.get<Integrator>("auto");
    method = plugin.make_from_others(
        Params(plugin.title(), plugin.params, given, {}), [this](const MethodChoice& choice) {
          asked.methods.push_back(choice);
          return std::make_unique<Noted>(choice.name, asked, behaviour);
        });
    std::ranges::fill(x.span(), 0.0);
    method->prepare(of);
    method->restart(0, h, x.data());
  }
  std::string name() const { return asked.now; }
  double given(const std::string& parameter) const {
    const auto& all = asked.methods.back().given;
    return all.contains(parameter) ? std::get<double>(all.at(parameter)) : -1;
  }
  Advance step(double h, std::int64_t most = 1) {
    const Advance now = method->advance(*system, t, h, most, x.data(), next.data());
    t += h * now.taken;
    return now;
  }
};

std::string chosen(Modes& system, double h, double tol) {
  return Trial(system, h, {{"tol", tol}}).name();
}

}  // namespace

TEST_CASE("auto hands its tolerances on, the loosest of stiff methods included") {
  Modes calm(3, false), stiff(6, false), few(4), many(24);
  calm.omega = 1, stiff.omega = 1000, few.decay = many.decay = 1000;
  struct Case {
    Modes* system;
    const char* name;
    double most;
  };
  for (const Case& each : {Case{&calm, "dopri5", 1}, Case{&stiff, "esdirk43", 1e-5},
                           Case{&few, "rodas4", 1e-5}, Case{&many, "bdf", 1e-5}})
    for (const double tol : {1e-2, 2e-5, 1e-5, 3e-6}) {
      INFO(each.name << ", " << tol);
      const double own = std::min(tol, each.most);
      const Trial plain(*each.system, 1, {{"tol", tol}});
      CHECK(plain.name() == each.name);
      CHECK(plain.given("tol") == own);
      CHECK(plain.given("atol") == -1);
      const Trial both(*each.system, 1, {{"rtol", tol}, {"atol", 1e-9}, {"tol", 0.5}});
      CHECK(both.name() == each.name);
      CHECK(both.given("tol") == tol);  // with an absolute tolerance of its own
      CHECK(both.given("atol") == 1e-9);
    }
  Modes waves(6, false);
  waves.omega = 1, waves.splits = true;
  const Trial splitting(waves, 0.1, {{"tol", 1e-5}, {"atol", 1e-9}});
  CHECK(splitting.name() == "pefrl");
  CHECK(splitting.asked.methods.back().given.empty());  // it has none
}

TEST_CASE("auto changes its mind at the thresholds that it tells") {
  Modes waves(6, false);
  waves.splits = true;
  const auto at = [&](double omega, double gamma, double tol) {
    waves.omega = omega, waves.gamma = gamma;
    return chosen(waves, 1, tol);
  };
  CHECK(at(199, 0, 1e-5) == "pefrl");
  CHECK(at(201, 0, 1e-5) == "esdirk43");
  CHECK(at(201, 0, 1.01e-10) == "esdirk43");
  CHECK(at(201, 0, 0.99e-10) == "dop853");
  CHECK(at(1, 0, 1.01e-3) == "verlet");
  CHECK(at(1, 0, 0.99e-3) == "pefrl");
  CHECK(at(1, 0, 1.01e-7) == "pefrl");
  CHECK(at(1, 0, 0.99e-7) == "dop853");
  CHECK(at(9, 0.99, 1e-5) == "pefrl");
  CHECK(at(9, 1.01, 1e-5) == "verlet");
  CHECK(at(1.01e-3, 0, 1e-5) == "pefrl");
  CHECK(at(0.99e-3, 0, 1e-5) == "dopri5");
  CHECK(at(0, 0, 1e-5) == "dopri5");
  waves.splits = false;
  CHECK(at(9, 0, 1e-5) == "dopri5");
  waves.obstacles = true;
  CHECK(at(9, 0, 1e-12) == "rk4");
  CHECK(at(900, 0, 1e-5) == "rk4");
  waves.splits = true;
  CHECK(at(9, 0, 1e-12) == "verlet");

  Modes few(16), more(17), points(15, false);
  few.decay = more.decay = points.decay = 10.1;
  CHECK(chosen(few, 1, 1.01e-6) == "rodas4");
  CHECK(chosen(few, 1, 0.99e-6) == "bdf");
  CHECK(chosen(more, 1, 1.01e-6) == "bdf");
  CHECK(chosen(points, 1, 1e-5) == "dopri5");  // no list of numbers
  few.decay = more.decay = points.decay = 9.9;
  CHECK(chosen(few, 1, 1e-5) == "dop853");
  CHECK(chosen(few, 1, 2.9e-4) == "dop853");
  CHECK(chosen(few, 1, 3.1e-4) == "dopri5");
  CHECK(chosen(more, 1, 1e-5) == "dopri5");
  CHECK(chosen(points, 1, 1e-5) == "dopri5");
}

TEST_CASE("equal steps of auto are at most half of the stable one") {
  Modes waves(6, false);
  waves.splits = true;
  for (const auto& [omega, count] :
       {std::pair(0.5, 1), {0.999, 1}, {1.01, 2}, {3.5, 4}, {7.99, 8}}) {
    INFO(omega);
    waves.omega = omega;
    Trial trial(waves, 1, {{"tol", 1e-2}});
    REQUIRE(trial.name() == "verlet");
    CHECK(trial.asked.restarts.back() == 1.0 / count);
    trial.asked.steps.clear();
    trial.asked.begins.clear();
    REQUIRE(trial.step(1).taken == 1);
    REQUIRE(trial.asked.steps == std::vector<double>(slot(count), 1.0 / count));
    for (int i = 0; i < count; ++i)
      CHECK(trial.asked.begins[slot(i)] == Approx(1.0 * i / count).margin(1e-15));
    // Several at once, until it is time for a look: after 2000 evaluations, 4 of each step.
    trial.behaviour.at_once = 1000;
    CHECK(trial.step(1, 3).taken == 3);
    CHECK(trial.asked.most.back() == 3 * count);
    const int left = static_cast<int>(std::ceil((2000.0 - 4 * 4 * count) / (4 * count)));
    CHECK(trial.step(1, 1000).taken == std::min(64, left));
    CHECK(trial.asked.most.back() == std::min(64, left) * count);
    CHECK_THAT(
        trial.method->notes().front(),
        Contains(count > 1 ? std::to_string(count) + " steps to each of 1 s" : "steps of 1 s"));
  }
}

TEST_CASE("steps that a method takes together end at a step of the run") {
  Modes waves(6, false);
  waves.splits = true;
  waves.omega = 3.5;  // four steps to each
  Trial trial(waves, 1, {{"tol", 1e-2}});
  using Counts = std::vector<std::int64_t>;
  // Two of twelve are taken at first: then two more are enough, for there are four to each.
  trial.behaviour.at_once = 2;
  trial.asked.most.clear();
  CHECK(trial.step(1, 3).taken == 1);
  CHECK(trial.asked.most == Counts{12, 2});
  trial.behaviour.at_once = 5;
  trial.asked.most.clear();
  CHECK(trial.step(1, 3).taken == 2);
  CHECK(trial.asked.most == Counts{12, 3});
  // One that fails after others: it begins anew at the state before, with one step alone.
  trial.behaviour.at_once = 2;
  trial.behaviour.fails_at = trial.t + 1.6;
  trial.asked.most.clear();
  trial.asked.restarts.clear();
  trial.behaviour.at_once = 5;
  CHECK(trial.step(1, 3).taken == 1);
  CHECK(trial.asked.most == Counts{12, 3, 4});
  CHECK(trial.asked.restarts == std::vector<double>{0.25});
  // One that fails within the first step of the run ends it.
  trial.behaviour.at_once = 1;
  trial.behaviour.fails_at = trial.t + 0.3;
  trial.asked.most.clear();
  trial.asked.restarts.clear();
  CHECK(trial.step(1, 3).status == StepStatus::kNotFinite);
  CHECK(trial.asked.most == Counts{12, 3});
  CHECK(trial.asked.restarts == std::vector<double>{0.25});
}

// x grows by c h^3 a step: against two halves the error is c h^3 (1 - 1/4) / 3 in a method of
// order 2, and in steps of h f it is f^3 of that.
TEST_CASE("equal steps of auto are as short as its tolerance wants") {
  Modes waves(6, false);
  waves.splits = true;
  waves.omega = 0.01;
  constexpr double kTol = 0.01;
  for (const double excess : {0.9, 1.1, 5.0, 50.0}) {  // tolerances that the error is
    INFO(excess);
    Trial trial(waves, 1, {{"tol", kTol}});
    // The state at the end is c / 4; the tolerance is of the larger of that and 0.
    const double c = excess * kTol / (0.25 - 0.25 * excess * kTol);
    trial.behaviour.error = c;
    trial.method->restart(0, 1, trial.x.data());
    const double longest = excess > 1 ? 0.9 * std::pow(excess, -1.0 / 3) : 1;
    CHECK(trial.asked.restarts.back() == 1 / std::ceil(1 / longest - 1e-9));
  }
}

TEST_CASE("explicit steps of auto that fail are followed by implicit ones") {
  Modes waves(6, false);
  waves.omega = 1;
  for (const StepStatus status : {StepStatus::kStepTooSmall, StepStatus::kNotFinite}) {
    Trial trial(waves, 1, {{"tol", 1e-4}});
    trial.behaviour.status = status;
    REQUIRE(trial.name() == "dopri5");
    CHECK(trial.step(1).taken == 1);
    CHECK(trial.name() == "esdirk43");
    CHECK(trial.given("tol") == 1e-5);
    CHECK_THAT(trial.method->notes().front(),
               Contains("auto: esdirk43") && Contains("explicit ones failed"));
    // Both are counted.
    CHECK(trial.method->effort().steps == 1);
  }
  Trial stopped(waves, 1);
  stopped.behaviour.status = StepStatus::kStopped;
  CHECK(stopped.step(1).status == StepStatus::kStopped);
  CHECK(stopped.asked.methods.size() == 1);
  Trial sharp(waves, 1, {{"tol", 1e-11}});
  sharp.behaviour.status = StepStatus::kStepTooSmall;
  CHECK(sharp.name() == "dop853");
  CHECK(sharp.step(1).status == StepStatus::kStepTooSmall);
  CHECK(sharp.asked.methods.size() == 1);
  Modes flat(8);
  flat.decay = 1;
  Trial list(flat, 1);
  list.behaviour.status = StepStatus::kStepTooSmall;
  list.step(1);
  CHECK(list.asked.methods.back().name == "rodas4");
}

TEST_CASE("auto looks again after two thousand evaluations") {
  Modes waves(6, false);
  waves.omega = 1;
  Trial trial(waves, 1);
  trial.behaviour.evaluations = 500;
  REQUIRE(trial.name() == "dopri5");
  waves.omega = 1000;  // it has become stiff meanwhile
  for (int i = 0; i < 4; ++i) trial.step(1);
  CHECK(trial.name() == "dopri5");
  trial.step(1);
  CHECK(trial.name() == "esdirk43");
  CHECK(trial.asked.restarts.size() == 2);

  // Implicit steps that are shorter than 50 / omega, ten one after the other: it looks again, and
  // takes explicit ones for twenty steps.
  waves.omega = 250;
  trial.behaviour.own_steps = 6;  // 41 / omega
  trial.behaviour.evaluations = 0;
  trial.step(1);  // the rate that is known is that of the last look
  trial.behaviour.own_steps = 5;
  Trial shorter(waves, 1);
  REQUIRE(shorter.name() == "esdirk43");
  shorter.behaviour.own_steps = 5;  // exactly 50 / omega: not shorter
  for (int i = 0; i < 5; ++i) shorter.step(1);
  CHECK(shorter.asked.methods.size() == 1);
  shorter.behaviour.own_steps = 6;
  shorter.step(1);
  shorter.behaviour.own_steps = 1;  // in between it was long
  shorter.step(1);
  shorter.behaviour.own_steps = 6;
  shorter.step(1);
  shorter.step(1);
  CHECK(shorter.name() == "esdirk43");
  shorter.step(1);
  CHECK(shorter.name() == "dopri5");
  for (int i = 0; i < 19; ++i) shorter.step(1);
  CHECK(shorter.name() == "dopri5");
  // Held on for twenty steps: then the next look may choose implicit ones again.
  shorter.behaviour.evaluations = 2000;
  shorter.step(1);
  const std::int64_t before = shorter.method->effort().steps;
  shorter.step(1);
  CHECK(shorter.name() == "esdirk43");
  // Each was made once, and what all of them did counts.
  CHECK(shorter.asked.methods.size() == 2);
  CHECK(shorter.method->effort().steps == before + shorter.behaviour.own_steps);
}

// A list of at most 16 numbers is looked at after 500, 1000 and then 2000 evaluations, and a step
// is made in parts unless the one before took at most 100.
TEST_CASE("auto looks earlier at small lists") {
  Modes list(16), larger(17), points(15, false);
  for (Modes* each : {&list, &larger, &points}) each->omega = 1;
  const auto looks_after = [](Modes& system, std::int64_t evaluations) {
    system.decay = 0;
    Trial trial(system, 1, {{"tol", 1e-3}});
    REQUIRE(trial.name() == "dopri5");
    trial.behaviour.evaluations = 1;
    trial.step(1);  // 13 parts of a list
    trial.behaviour.evaluations = evaluations;
    system.decay = 1000;  // it has become stiff meanwhile
    for (int i = 1; i < 100; ++i) {
      trial.step(1);
      if (trial.asked.methods.size() > 1) return i;
    }
    return 100;
  };
  CHECK(looks_after(list, 97) == 7);  // 13 + 5 * 97 < 500
  CHECK(looks_after(list, 98) == 6);
  CHECK(looks_after(larger, 99) == 22);  // 1 + 20 * 99 < 2000
  CHECK(looks_after(larger, 100) == 21);
  CHECK(looks_after(points, 100) == 21);

  // Every look makes the same choice, and the next one comes later.
  list.decay = 0;
  Trial calm(list, 1, {{"tol", 1e-3}});
  calm.behaviour.evaluations = 1;
  calm.step(1);
  calm.behaviour.evaluations = 50;
  const auto looks = [&] { return static_cast<int>(calm.method->memory()[0]) / 16 % 4; };
  std::vector<int> when;
  for (int n = 1, before = 0; n <= 100; ++n) {
    calm.step(1);
    if (looks() != before) when.push_back(n);
    before = looks();
  }
  CHECK(when == std::vector<int>{11, 31});  // before the steps after 500 and 1500

  // Parts of the first step; none of the next.
  Trial parts(list, 1, {{"tol", 1e-3}});
  parts.behaviour.evaluations = 5;
  parts.asked.begins.clear();
  parts.step(1);
  REQUIRE(parts.asked.steps.size() == 13);
  double end = 0;
  for (std::size_t i = 0; i < 13; ++i) {
    CHECK(parts.asked.begins[i] == end);
    end = std::ldexp(1.0, static_cast<int>(i) - 12);
    CHECK(parts.asked.begins[i] + parts.asked.steps[i] == end);
  }
  parts.asked.steps.clear();
  parts.step(1);
  CHECK(parts.asked.steps == std::vector<double>{1});
  // Again where a step took more than a hundred.
  parts.behaviour.evaluations = 101;
  parts.step(1);
  parts.behaviour.evaluations = 1;
  parts.asked.steps.clear();
  parts.step(1);
  CHECK(parts.asked.steps.size() == 13);
}

TEST_CASE("auto takes back what it can have written, and nothing else") {
  Modes waves(6, false);
  waves.omega = 3.5;
  waves.splits = true;
  Trial one(waves, 1), other(waves, 0.25);
  REQUIRE(one.name() == "pefrl");
  const std::vector<double> memory = one.method->memory();
  REQUIRE(memory.size() == 7);
  CHECK(memory.back() == 42);  // of the method
  CHECK(memory[1] == Approx(2 / 3.5 / 2));
  CHECK(memory[2] == Approx(3.5));
  other.method->recall(memory);
  std::vector<double> kept = other.method->memory();
  CHECK(kept == memory);
  const auto refused = [&](std::size_t place, double value) {
    Trial trial(waves, 0.25);
    const std::vector<double> before = trial.method->memory();
    std::vector<double> changed = memory;
    changed[place] = value;
    trial.method->recall(changed);
    return trial.method->memory() == before;
  };
  for (const double choice : {-1.0, 0.0, 0.5, 2.5, 7.0, 8.0, 9.0, 16.0, 25.0, 128.0, 130.0, 1e300})
    CHECK(refused(0, choice));
  for (const double choice : {1.0, 3.0, 4.0, 5.0, 6.0, 17.0, 36.0, 65.0, 113.0})
    CHECK_FALSE(refused(0, choice));
  CHECK(refused(1, 0));
  CHECK(refused(1, -1));
  CHECK(refused(1, std::nan("")));
  for (std::size_t place = 2; place < 6; ++place) {
    CHECK(refused(place, -1e-9));
    CHECK(refused(place, std::nan("")));
    CHECK_FALSE(refused(place, 0.125));
  }
  Trial trial(waves, 0.25);
  const std::vector<double> before = trial.method->memory();
  trial.method->recall(std::span(memory).first(5));
  CHECK(trial.method->memory() == before);
  waves.splits = false;
  Trial unsplit(waves, 1);
  const std::vector<double> own = unsplit.method->memory();
  unsplit.method->recall(memory);
  CHECK(unsplit.method->memory() == own);
}
