#include "straight_stepper.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/finite.h"
#include "ensemble.h"

namespace sim {
namespace {

constexpr int kAtOnce = 256;  // steps: the overhead of a call is small beside them

int count_weights(std::span<const double> weights) {
  return static_cast<int>(weights.size() -
                          static_cast<std::size_t>(std::ranges::count(weights, 0.0)));
}

// out := base + h sum_j weights_j k_j of N numbers, which stay in registers; the numbers of k_(j+1)
// are `stride` behind those of k_j.
template <int N>
void add_slopes(const double* base, double h, std::span<const double> weights, const double* k,
                int stride, double* out) {
  std::array<double, N> sum;
#pragma GCC unroll 4
  for (int i = 0; i < N; ++i) sum[i] = base[i];
  for (const double weight : weights) {
    if (weight != 0) {
      const double scaled = h * weight;
#pragma GCC unroll 4
      for (int i = 0; i < N; ++i) sum[i] += scaled * k[i];
    }
    k += stride;
  }
#pragma GCC unroll 4
  for (int i = 0; i < N; ++i) out[i] = sum[i];
}

}  // namespace

bool StraightStepper::fits(const Code& code, const ExplicitPlan& plan) {
  return StageProgram::fits(code, plan.stages, count_weights(plan.a) + count_weights(plan.b));
}

StraightStepper::StraightStepper(const Code& code, const ExplicitPlan& plan,
                                 const EnsembleLane& beside)
    : plan_(plan),
      beside_(beside),
      program_(code, plan.stages, StageProgram::Steps::kEqual),
      at_once_(code.reads.back() ? 1 : kAtOnce) {  // formulas that read t need each time
  add_step(program_, plan_);
  code_ = program_.take([this](int number) { return number < program_.size(); });
}

bool StraightStepper::step(double t, double h, int count, const double* x, double* x_next) {
  std::optional<int> beside;
  if (beside_.ensemble)
    beside = beside_.ensemble->advance(beside_.lane, plan_, t, h, count, x, x_next);
  const int made = beside.value_or(0);
  if (made > 0) x = x_next;
  program_.set_step(h);
  for (int stage = 0; stage < plan_.stages; ++stage)
    program_.set_time(stage, t + plan_.c[static_cast<std::size_t>(stage)] * h);
  const auto size = static_cast<std::size_t>(program_.size());
  std::copy_n(x, size, program_.slots());
  for (int i = made; i < count; ++i) code_.run(program_.slots());
  std::copy_n(program_.slots(), size, x_next);
  const bool finite = all_finite({x_next, size});
  if (finite && beside) beside_.ensemble->arrive(beside_.lane, count, x_next);
  return finite;
}

bool StraightPair::fits(const Code& code, const EmbeddedPlan& plan) {
  int weights =
      count_weights(plan.method.b) + count_weights(plan.error) + count_weights(plan.coarse);
  for (const auto& row : plan.a) weights += count_weights(row);
  return StageProgram::fits(code, static_cast<int>(plan.c.size()), weights,
                            kNumbers + 2 * code.outputs);
}

StraightPair::StraightPair(const Code& code, const EmbeddedPlan& plan)
    : plan_(plan),
      program_(code, static_cast<int>(plan.c.size()), StageProgram::Steps::kChanging,
               kNumbers + 2 * code.outputs) {
  const auto take = [this] {
    return program_.take([this](int number) { return program_.is_result(number); });
  };
  program_.add_slope(0, program_.x());
  start_ = take();
  for (int stage = 1; stage < plan_.stages; ++stage)
    program_.add_stage(plan_.a[static_cast<std::size_t>(stage)], stage);
  program_.add_copy(program_.add_sum(plan_.method.b, program_.next()), program_.next());
  step_ = take();
  program_.add_slope(plan_.stages, program_.next());
  close_ = take();
  for (std::size_t stage = static_cast<std::size_t>(plan_.stages) + 1; stage < plan_.c.size();
       ++stage)
    program_.add_stage(plan_.a[stage], static_cast<int>(stage));
  extend_ = take();
  add_norms();
  norms_ =
      program_.take([this](int slot) { return slot == number(kFine) || slot == number(kCoarse); });
}

// The largest |e_i| / (atol + rtol max(|x_i|, |x_next_i|)).
void StraightPair::add_norms() {
  constexpr unsigned kFirst = 1, kLast = 4;
  const int scale = program_.scratch() + kNumbers, ratio = scale + program_.size();
  program_.add(Op::kAbs, scale, {program_.x()});
  program_.add(Op::kAbs, ratio, {program_.next()});
  program_.add(Op::kMax, scale, {scale, ratio});
  program_.add(Op::kProductPlus, scale, {number(kRtol), scale, number(kAtol)}, kFirst | kLast);
  const auto add_norm = [&](std::span<const double> weights, Number to) {
    if (count_weights(weights) == 0) return;
    program_.add_slopes(weights, ratio);
    program_.add(Op::kAbs, ratio, {ratio});
    program_.add(Op::kDivide, ratio, {ratio, scale});
    program_.add_largest(ratio, number(to));
  };
  add_norm(plan_.error, kFine);
  add_norm(plan_.coarse, kCoarse);
}

// Step and states are still in their slots.
std::optional<ErrorNorms> StraightPair::error_norms(const Tolerance& tolerance) {
  double* const slots = program_.slots();
  slots[number(kAtol)] = tolerance.atol;
  slots[number(kRtol)] = tolerance.rtol;
  norms_.run(slots);
  const auto finite = [&](Number which) {
    const double norm = slots[number(which)];
    return std::isfinite(norm) ? norm : std::nan("");
  };
  return ErrorNorms{finite(kFine), finite(kCoarse)};
}

bool StraightPair::is_finite(int slot) const {
  double poison = 0;
  for (int i = 0; i < program_.size(); ++i) poison += 0 * program_.slots()[slot + i];
  return poison == 0;
}

void StraightPair::set_times(double t, double h, int first, int last) {
  program_.set_step(h);
  if (!program_.reads_time()) return;
  for (int stage = first; stage < last; ++stage)
    program_.set_time(stage, t + plan_.c[static_cast<std::size_t>(stage)] * h);
}

bool StraightPair::start(double t, const double* x) {
  std::copy_n(x, program_.size(), program_.slots());
  program_.set_time(0, t);
  start_.run(program_.slots());
  return is_finite(program_.k(0));
}

bool StraightPair::step(double t, double h, const double* x, double* x_next) {
  set_times(t, h, 1, plan_.stages);
  std::copy_n(x, program_.size(), program_.slots());
  step_.run(program_.slots());
  std::copy_n(program_.slots() + program_.next(), program_.size(), x_next);
  return is_finite(program_.next());
}

bool StraightPair::close(double t, const double* x) {
  std::copy_n(x, program_.size(), program_.slots() + program_.next());
  program_.set_time(plan_.stages, t);
  close_.run(program_.slots());
  return is_finite(program_.k(plan_.stages));
}

void StraightPair::extend(double t, double h, const double* x) {
  set_times(t, h, plan_.stages + 1, static_cast<int>(plan_.c.size()));
  std::copy_n(x, program_.size(), program_.slots());
  extend_.run(program_.slots());
}

void StraightPair::combine(const double* /*x*/, double h, std::span<const double> weights,
                           const double* base, double* out) {
  const int size = program_.size();
  const double* const k = program_.slots() + program_.k(0);
  int i = 0;
  for (; i + 4 <= size; i += 4) add_slopes<4>(base + i, h, weights, k + i, size, out + i);
  switch (size - i) {
    case 1:
      return add_slopes<1>(base + i, h, weights, k + i, size, out + i);
    case 2:
      return add_slopes<2>(base + i, h, weights, k + i, size, out + i);
    case 3:
      return add_slopes<3>(base + i, h, weights, k + i, size, out + i);
    default:
      return;
  }
}

void StraightPair::shift() {
  double* const slots = program_.slots();
  std::copy_n(slots + program_.k(plan_.stages), program_.size(), slots + program_.k(0));
}

}  // namespace sim
