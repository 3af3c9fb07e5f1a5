// Steps that end at events: what is asked of the events, and of the method, call by call.
#include "core/ode/cut_steps.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/ode/explicit/explicit_rk.h"
#include "plugins/integrators/stiff/adaptive_implicit.h"
#include "tests/ode/driven_system.h"

using namespace sim;

namespace {

// Events at given times, found at the second look; those of one kind turn the state over.
class Planned final : public Events {
 public:
  struct Event {
    double t;
    bool jumps;
  };
  explicit Planned(std::vector<Event> events) : events_(std::move(events)) {}

  void begin(double t, double h, const double*) override { begun.emplace_back(t, h); }
  double first(double t, double h, const double*, const double*) override {
    ++looks;
    for (const Event& event : events_)
      if (event.t > t + 1e-12 && event.t < t + h - 1e-9)
        return ++found % 2 == 1 ? 0.5 * (1 + (event.t - t) / h) : (event.t - t) / h;
    return 1;
  }
  Outcome end(double t, double h, const double*, double* x, bool cut) override {
    ended.emplace_back(t, h);
    all_cut &= cut;
    if (not_allowed_after < t + h) return Outcome::kNotAllowed;
    for (const Event& event : events_)
      if (std::fabs(event.t - t - h) < 1e-9 && event.jumps) {
        x[0] = -x[0];
        return Outcome::kImpact;
      }
    return Outcome::kSmooth;
  }
  void gave_up() override { ++given_up; }
  void repeated() override {}

  std::vector<std::pair<double, double>> begun, ended;
  int looks = 0, found = 0, given_up = 0;
  bool all_cut = true;
  double not_allowed_after = HUGE_VAL;

 private:
  std::vector<Event> events_;
};

// x' = 2 x
class Growing final : public OdeSystem {
 public:
  explicit Growing(Events* events) : events_(events) {}
  std::size_t size() const noexcept override { return 1; }
  void eval(double, const Stage& stage, double* y, double* dydt) override {
    combine(stage, y);
    dydt[0] = 2 * y[0];
  }
  void combine(const Stage& stage, double* out) override {
    double sum = stage.x[0];
    for (const auto& term : stage.terms) sum += term.coef * term.k[0];
    out[0] = sum;
  }
  Events* events() override { return events_; }

 private:
  Events* events_;
};

// Euler's method that writes down its beginnings.
class Noted final : public Integrator {
 public:
  IntegratorInfo info() const noexcept override { return {.order = 1}; }
  void prepare(OdeSystem&) override {}
  Advance advance(OdeSystem&, double, double h, std::int64_t, const double* x,
                  double* x_next) override {
    ++steps;
    x_next[0] = x[0] + h * 2 * x[0];
    return {steps == fails_at ? StepStatus::kNotConverged : StepStatus::kDone, 1};
  }
  void restart(double t, double h, const double* x) override { restarts.push_back({t, h, x[0]}); }

  std::vector<std::array<double, 3>> restarts;
  int steps = 0, fails_at = 0;
};

void check_pairs(const std::vector<std::pair<double, double>>& found,
                 const std::vector<std::pair<double, double>>& expected) {
  REQUIRE(found.size() == expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    CAPTURE(i);
    CHECK(found[i].first == Approx(expected[i].first).margin(1e-12));
    CHECK(found[i].second == Approx(expected[i].second).margin(1e-12));
  }
}

struct Cut {
  Planned events;
  Growing system{&events};
  Noted* noted;
  CutSteps method;
  double x_next = 0;

  explicit Cut(std::vector<Planned::Event> planned)
      : events(std::move(planned)), noted(new Noted), method(std::unique_ptr<Integrator>(noted)) {
    method.prepare(system);
  }
  StepStatus step(double t, double h) {
    const double x = 3;
    return method.step(system, t, h, &x, &x_next);
  }
};

}  // namespace

TEST_CASE("a step is cut at its events, each of which may turn it over") {
  Cut cut({{1.3, true}, {1.6, false}});
  REQUIRE(cut.step(1, 1) == StepStatus::kDone);
  check_pairs(cut.events.begun, {{1, 1}, {1.3, 0.7}, {1.6, 0.4}});
  check_pairs(cut.events.ended, {{1, 0.3}, {1.3, 0.3}, {1.6, 0.4}});
  CHECK(cut.events.looks == 7);
  CHECK(cut.events.all_cut);
  CHECK(cut.events.given_up == 0);
  CHECK(cut.x_next == Approx(3 * 1.6 * -1 * 1.6 * 1.8).epsilon(1e-12));
  // Anew from the first event on, once for each trial, and at the end for what follows.
  REQUIRE(cut.noted->restarts.size() == 7);
  const auto& last = cut.noted->restarts.back();
  CHECK(last[0] == 2);
  CHECK(last[1] == 1);
  CHECK(last[2] == cut.x_next);
  CHECK(cut.noted->restarts[0][1] == Approx(0.65).epsilon(1e-12));
  CHECK(cut.noted->restarts[1][1] == Approx(0.3).epsilon(1e-12));
  CHECK(cut.noted->restarts[2][0] == Approx(1.3).epsilon(1e-12));
}

TEST_CASE("a step without events stays whole, and one that ends in a jump begins anew") {
  Cut whole({});
  REQUIRE(whole.step(1, 0.5) == StepStatus::kDone);
  CHECK(whole.x_next == 6);
  CHECK(whole.events.looks == 1);
  CHECK(whole.noted->restarts.empty());

  Cut jump({{1.5, true}});
  REQUIRE(jump.step(1, 0.5) == StepStatus::kDone);
  CHECK(jump.x_next == -6);
  REQUIRE(jump.noted->restarts.size() == 1);
  CHECK(jump.noted->restarts[0] == std::array{1.5, 0.5, -6.0});
}

TEST_CASE("so many events are cut in a step, the rest of it is whole") {
  std::vector<Planned::Event> many;
  for (int i = 1; i <= 80; ++i) many.push_back({1 + 0.01 * i, false});
  Cut cut(many);
  REQUIRE(cut.step(1, 1) == StepStatus::kDone);
  CHECK(cut.events.ended.size() == EventSeries::kSettles + 1);
  CHECK(cut.events.ended.back().first == Approx(1 + 0.01 * EventSeries::kSettles).epsilon(1e-12));
  CHECK(cut.events.given_up == 1);
  CHECK_FALSE(cut.events.all_cut);
}

// Bounces, each 0.9 times as long as the one before, that go on as even ones: 32 cuts, one step of
// ten times the last, 31 cuts, and the rest.
TEST_CASE("events that come ever faster are settled in one short step, and then in a whole one") {
  std::vector<Planned::Event> bounces;
  double t = 1, length = 0.09, last = 0;
  while (bounces.size() < 200) {
    length = bounces.size() < EventSeries::kSettles ? 0.9 * length : 5e-4;
    bounces.push_back({t += length, false});
    if (bounces.size() == EventSeries::kSettles) last = length;
  }
  Cut cut(bounces);
  REQUIRE(cut.step(1, 1) == StepStatus::kDone);
  REQUIRE(cut.events.ended.size() == EventSeries::kMost + 1);
  const auto& settling = cut.events.ended[EventSeries::kSettles];
  CHECK(settling.first == Approx(bounces[EventSeries::kSettles - 1].t).epsilon(1e-12));
  CHECK(settling.second == Approx(10 * last).epsilon(1e-6));
  CHECK(cut.events.given_up == 2);
}

TEST_CASE("a series of events is remembered, and starts anew after a step without one") {
  const auto settled = [] {
    EventSeries series;
    for (double length = 1; series.cuts(); length *= 0.9) {
      CHECK(series.longest() == HUGE_VAL);
      series = EventSeries::recalled(series.memory().data());
      series.add(true, length);
    }
    return series;
  };
  EventSeries series = settled();
  CHECK(series.has_cut());
  CHECK(series.longest() == Approx(10 * std::pow(0.9, EventSeries::kSettles - 1)));
  series.add(false, series.longest());
  CHECK(series.cuts());
  CHECK_FALSE(series.has_cut());
  series.add(false, 1);
  CHECK(series.memory()[0] == 0);
  CHECK(settled().memory() == settled().memory());

  EventSeries even;
  for (int i = 0; i < EventSeries::kSettles; ++i) even.add(true, 0.5);
  CHECK_FALSE(even.cuts());
  CHECK(even.longest() == HUGE_VAL);
  even.add(false, 7);
  CHECK_FALSE(even.has_cut());
  even.add(true, 0.5);
  CHECK(even.memory()[0] == 1);
  const double nonsense[EventSeries::kMemory] = {-3, 0.5, 0, 0};
  CHECK(EventSeries::recalled(nonsense).memory()[0] == 0);
}

TEST_CASE("a step that fails on the way shows the numbers it has") {
  Cut fails({{1.3, false}});
  fails.noted->fails_at = 4;
  CHECK(fails.step(1, 1) == StepStatus::kNotConverged);
  CHECK(fails.x_next == Approx(3 * 1.6 * 2.4).epsilon(1e-12));

  Cut refused({{1.3, false}});
  refused.events.not_allowed_after = 1.5;
  CHECK(refused.step(1, 1) == StepStatus::kNotFinite);
  CHECK(refused.x_next == Approx(3 * 1.6 * 2.4).epsilon(1e-12));
}

TEST_CASE("adaptive implicit steps end at events and where a state is asked for") {
  class Solver final : public StageSolver {
   public:
    StepStatus solve(double, double tau, const double* r, double* y) override {
      y[0] = r[0] / (1 - 2 * tau);
      return StepStatus::kDone;
    }
    Effort effort() const override { return {}; }
  };
  class Implicit final : public OdeSystem {
   public:
    explicit Implicit(Events* events) : growing_(events) {}
    std::size_t size() const noexcept override { return 1; }
    void eval(double t, const Stage& stage, double* y, double* dydt) override {
      growing_.eval(t, stage, y, dydt);
    }
    void combine(const Stage& stage, double* out) override { growing_.combine(stage, out); }
    Events* events() override { return growing_.events(); }
    std::unique_ptr<StageSolver> stage_solver(const StageOptions&) override {
      return std::make_unique<Solver>();
    }

   private:
    Growing growing_;
  };
  constexpr ImplicitPair<2> kTrapezoid{
      .method = {.a = {{{}, {0.5, 0.5}}}, .b = {0.5, 0.5}, .c = {0, 1}}, .embedded = {0.4, 0.6}};
  Planned events({{1.3, true}, {1.8, true}});
  Implicit system(&events);
  AdaptiveImplicit method(kTrapezoid, 2, {.atol = 1e9, .rtol = 0}, {});
  method.prepare(system);
  double x = 3, x_next = 0;
  REQUIRE(method.step(system, 1, 0.8, &x, &x_next) == StepStatus::kDone);
  check_pairs(events.ended, {{1, 0.3}, {1.3, 0.5}});
  const auto growth = [](double h) { return (1 + h) / (1 - h); };
  CHECK(x_next == Approx(3 * growth(0.3) * growth(0.5)).epsilon(1e-12));
  CHECK(method.effort().evaluations == 2);  // at the beginning and after the jump
  CHECK(method.effort().steps == 2);
  // The slope is another one after what happened at the end, too.
  x = x_next;
  REQUIRE(method.step(system, 1.8, 0.4, &x, &x_next) == StepStatus::kDone);
  CHECK(x_next == Approx(x * growth(0.4)).epsilon(1e-12));
  CHECK(method.effort().evaluations == 3);
}
