// Checks of integrators, on particles in a smooth anharmonic well.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/base/thread_pool.h"
#include "core/math/elementary.h"
#include "core/particles/particle_system.h"
#include "core/plugin/registered_solvers.h"
#include "core/study/contract/examiner.h"

namespace sim::study::contract {
namespace {

constexpr int kParticles = 3;
constexpr int kMostAsked = 20'000;  // times that a course asks whether to stop
constexpr double kTime = 1;         // s, about a sixth of a period

// f = -x - x^3 along each axis, U = x^2/2 + x^4/4: smooth, without a closed solution.
class Well final : public Force {
 public:
  void accumulate(const ParticleView& p, Tile tile, ForceSink f) const override {
    for (int i = tile.begin; i < tile.end; ++i)
      f.add(i, {pull(p.x[i]), pull(p.y[i]), pull(p.z[i])});
  }
  bool depends_on_velocity() const override { return false; }
  double potential(const ParticleView& p, Tile tile) const override {
    double sum = 0;
    for (int i = tile.begin; i < tile.end; ++i)
      for (const double x : {p.x[i], p.y[i], p.z[i]}) sum += x * x * (2 + x * x) / 4;
    return sum;
  }
  bool conservative() const override { return true; }

 private:
  static double pull(double x) { return -x - x * x * x; }
};

// One method on the particles, from the same start.
class Course {
 public:
  explicit Course(const Method& method)
      : layout_(kParticles), start_(layout_.size()), x_(layout_.size()), next_(layout_.size()) {
    for (int i = 0; i < kParticles; ++i)
      for (int axis = 0; axis < 3; ++axis) {
        layout_.block(start_.data(), axis)[i] = 0.3 + 0.2 * i - 0.25 * axis;
        layout_.block(start_.data(), 3 + axis)[i] = 0.1 * axis - 0.2 * i;
      }
    std::vector<std::unique_ptr<Force>> forces;
    forces.push_back(std::make_unique<Well>());
    system_ = std::make_unique<ParticleSystem>(std::vector<double>{1, 1.5, 2}, std::vector<int>{},
                                               std::move(forces), start_.data(), pool_);
    system_->set_implicit_solvers(registered_solvers(method.registry()));
    // An adaptive method may take as many steps as a tolerance or a bound on them requires.
    system_->stop_when([this] { return ++asked_ > kMostAsked; });
    integrator_ = method.make();
    integrator_->prepare(*system_);
  }

  Integrator& integrator() { return *integrator_; }

  void begin(double h) {
    h_ = h;
    done_ = 0;
    asked_ = 0;
    std::ranges::copy(start_.span(), x_.data());
    integrator_->restart(0, h, x_.data());
  }

  // Continues from another course.
  void follow(const Course& other) {
    h_ = other.h_;
    done_ = other.done_;
    std::ranges::copy(other.x_.span(), x_.data());
    integrator_->restart(t(), h_, x_.data());
    integrator_->recall(other.integrator_->memory());
  }

  // Takes steps alone, without allocating.
  void take(int steps) {
    for (int i = 0; i < steps; ++i) {
      integrator_->step(*system_, t(), h_, x_.data(), next_.data());
      std::swap(x_, next_);
      ++done_;
    }
  }

  // False if a step fails. Notes whether a step changed its initial state.
  bool go(int steps) {
    for (int i = 0; i < steps; ++i) {
      const std::vector<double> before(x_.data(), x_.data() + x_.size());
      if (integrator_->step(*system_, t(), h_, x_.data(), next_.data()) != StepStatus::kDone)
        return false;
      kept_ = kept_ && same(before, x_.span());
      std::swap(x_, next_);
      ++done_;
    }
    return true;
  }

  std::span<const double> state() const { return x_.span(); }
  bool kept() const { return kept_; }

 private:
  double t() const { return done_ * h_; }

  Layout layout_;
  ThreadPool pool_{1};
  Array start_, x_, next_;
  std::unique_ptr<ParticleSystem> system_;
  std::unique_ptr<Integrator> integrator_;
  double h_ = 0;
  int done_ = 0;
  int asked_ = 0;
  bool kept_ = true;
};

double distance(std::span<const double> a, std::span<const double> b) {
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::fabs(a[i] - b[i]));
  return most;
}

// The method with fixed steps of size h, if it has that option.
Method fixed(Registry& registry, const IntegratorPlugin& plugin) {
  std::map<std::string, Value> given = example_values(plugin);
  for (const Param& param : plugin.params)
    if (param.name == "fixed_step") given["fixed_step"] = true;
  return Method(registry, plugin, given);
}

// The differences of runs with h and h/2 fall as h^p (Richardson 1911).
void check_order(const Method& method, Examiner& examiner) {
  constexpr const char* kName = "order";
  constexpr double kRounding = 3e-14, kShort = 0.3;
  Course course(method);
  course.begin(kTime / 4);
  if (!course.go(1))
    return examiner.failed(kName, "a step of " + std::to_string(kTime / 4) + " s fails");
  const IntegratorInfo info = course.integrator().info();
  if (info.order < 1) return examiner.skipped(kName, "it has none of its own");
  if (info.adaptive && !method.params().has("fixed_step"))
    return examiner.skipped(kName, "it chooses its own steps");
  std::vector<double> end, differences;
  for (int steps = 4; steps <= 512; steps *= 2) {
    course.begin(kTime / steps);
    if (!course.go(steps)) return examiner.failed(kName, "a run fails");
    if (!end.empty()) differences.push_back(distance(end, course.state()));
    end.assign(course.state().begin(), course.state().end());
  }
  double observed = -HUGE_VAL;
  for (std::size_t i = 0; i + 1 < differences.size(); ++i)
    if (differences[i + 1] > kRounding)
      observed = std::max(observed, elementary::log2(differences[i] / differences[i + 1]));
  if (observed == -HUGE_VAL) return examiner.skipped(kName, "the errors are roundings");
  char text[80];
  std::snprintf(text, sizeof text, "observed %.2f, said %d", observed, info.order);
  examiner.check(kName, observed > info.order - kShort, text);
}

void check_bits(const Method& method, Examiner& examiner) {
  constexpr int kSteps = 20;
  constexpr double kStep = 0.05;
  Course first(method), second(method);
  first.begin(kStep);
  if (!first.go(kSteps)) return examiner.failed("steps", "a step of 0.05 s fails");
  const std::vector<double> middle(first.state().begin(), first.state().end());
  examiner.check("a step leaves the old state as it is", first.kept(),
                 std::to_string(kSteps) + " steps");
  examiner.check("finite", finite(middle), std::to_string(kSteps) + " steps");

  second.begin(kStep);
  const bool resumed =
      second.go(3) && (second.follow(first), second.go(kSteps)) && first.go(kSteps);
  examiner.check("the same bits from memory()", resumed && same(first.state(), second.state()),
                 "another one goes on from the middle");
  first.begin(kStep);
  examiner.check("the same bits after a restart", first.go(kSteps) && same(first.state(), middle),
                 std::to_string(kSteps) + " steps");
  first.begin(kStep);
  first.take(kSteps);
  examiner.allocations(std::to_string(kSteps) + " steps", [&] { first.take(kSteps); });
  examiner.hash(middle);
}

}  // namespace

void check_integrator(Registry& registry, const IntegratorPlugin& plugin, Contract& contract) {
  Examiner examiner(plugin, contract);
  examiner.group("steps", [&] {
    try {
      Course(fixed(registry, plugin)).begin(kTime);
    } catch (const Error& error) {
      return examiner.skipped("steps",
                              "it refuses a smooth force of positions: " + error.text().why);
    }
    check_order(fixed(registry, plugin), examiner);
    check_bits(Method(registry, plugin, example_values(plugin)), examiner);
  });
  examiner.bounds([&](const Params& params) {
    std::map<std::string, Value> given;
    for (const Param& param : plugin.params)
      if (params.has(param.name)) given[param.name] = params.value(param.name);
    Course course(Method(registry, plugin, given));
    course.begin(0.01);
    if (!course.go(1)) throw Error(ErrorKind::kDiverged, {"a step fails", "", "", ""});
    return std::vector<double>(course.state().begin(), course.state().end());
  });
}

}  // namespace sim::study::contract
