#include "straight_stepper.h"

#include <algorithm>
#include <array>
#include <limits>

#include "core/base/finite.h"
#include "ensemble.h"

namespace sim {
namespace {

constexpr int kAtOnce = 256;  // steps: the overhead of a call is small beside them

std::uint16_t slot(int number) { return static_cast<std::uint16_t>(number); }

int count_weights(std::span<const double> weights) {
  return static_cast<int>(weights.size() -
                          static_cast<std::size_t>(std::ranges::count(weights, 0.0)));
}

std::span<const double> row_of(const ExplicitPlan& plan, int stage) {
  return std::span(plan.a).subspan(static_cast<std::size_t>(stage * plan.stages),
                                   static_cast<std::size_t>(stage));
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

bool StageProgram::fits(const Code& code, int stages, int weights) {
  constexpr std::size_t kMostInstructions = 20000;
  const int numbers = (3 + stages) * code.outputs + stages +
                      static_cast<int>(code.constants.size()) + code.registers + weights;
  return numbers <= std::numeric_limits<std::uint16_t>::max() &&
         code.instructions.size() * static_cast<std::size_t>(stages) <= kMostInstructions;
}

StageProgram::StageProgram(const Code& code, int stages)
    : code_(code),
      size_(code.outputs),
      y_(size_),
      next_(2 * size_),
      k_(3 * size_),
      times_(k_ + stages * size_),
      constants_(times_ + stages),
      registers_(constants_ + static_cast<int>(code.constants.size())) {
  slots_.resize(static_cast<std::size_t>(registers_ + code.registers), 0);
  std::ranges::copy(code.constants, slots_.begin() + constants_);
}

int StageProgram::add_sum(std::span<const double> weights, int y) {
  int from = x();
  for (std::size_t j = 0; j < weights.size(); ++j) {
    if (weights[j] == 0) continue;
    const int weight = static_cast<int>(slots_.size());
    weights_.push_back(weights[j]);
    slots_.push_back(0);
    for (int i = 0; i < size_; ++i)
      instructions_.push_back({Op::kProductPlus,
                               slot(y + i),
                               {slot(weight), slot(k(static_cast<int>(j)) + i), slot(from + i)}});
    from = y;
  }
  return from;
}

void StageProgram::add_slope(int stage, int point) {
  const auto moved = [&](int number) {
    if (number < size_) return point + number;
    if (number < code_.inputs) return times_ + stage;
    if (number < code_.first_constant()) return k(stage) + number - code_.inputs;
    if (number < code_.first_register()) return constants_ + number - code_.first_constant();
    return registers_ + number - code_.first_register();
  };
  for (Instruction now : code_.instructions) {
    now.to = slot(moved(now.to));
    for (int i = 0; i < operand_count(now.op); ++i) now.operand[i] = slot(moved(now.operand[i]));
    instructions_.push_back(now);
  }
}

void StageProgram::add_copy(int from, int to) {
  if (from == to) return;
  for (int i = 0; i < size_; ++i)
    instructions_.push_back({Op::kCopy, slot(to + i), {slot(from + i), 0, 0}});
}

void StageProgram::set_step(double h) {
  if (h == h_) return;
  h_ = h;
  double* const products = slots_.data() + first_weight();
  for (std::size_t i = 0; i < weights_.size(); ++i) products[i] = h * weights_[i];
}

bool StraightStepper::fits(const Code& code, const ExplicitPlan& plan) {
  return StageProgram::fits(code, plan.stages, count_weights(plan.a) + count_weights(plan.b));
}

void add_step(StageProgram& program, const ExplicitPlan& plan) {
  for (int stage = 0; stage < plan.stages; ++stage) program.add_stage(row_of(plan, stage), stage);
  program.add_copy(program.add_sum(plan.b, program.next()), program.x());
}

StraightStepper::StraightStepper(const Code& code, const ExplicitPlan& plan,
                                 const EnsembleLane& beside)
    : plan_(plan),
      beside_(beside),
      program_(code, plan.stages),
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
  int weights = count_weights(plan.method.b);
  for (const auto& row : plan.a) weights += count_weights(row);
  return StageProgram::fits(code, static_cast<int>(plan.c.size()), weights);
}

StraightPair::StraightPair(const Code& code, const EmbeddedPlan& plan)
    : plan_(plan), program_(code, static_cast<int>(plan.c.size())) {
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
}

bool StraightPair::slope_is_finite(int stage) {
  return all_finite(
      {program_.slots() + program_.k(stage), static_cast<std::size_t>(program_.size())});
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
  return slope_is_finite(0);
}

bool StraightPair::step(double t, double h, const double* x, double* x_next) {
  set_times(t, h, 1, plan_.stages);
  std::copy_n(x, program_.size(), program_.slots());
  step_.run(program_.slots());
  std::copy_n(program_.slots() + program_.next(), program_.size(), x_next);
  return all_finite({x_next, static_cast<std::size_t>(program_.size())});
}

bool StraightPair::close(double t, const double* x) {
  std::copy_n(x, program_.size(), program_.slots() + program_.next());
  program_.set_time(plan_.stages, t);
  close_.run(program_.slots());
  return slope_is_finite(plan_.stages);
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
