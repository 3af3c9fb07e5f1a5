#include "plugins/fields/straight_stepper.h"

#include <algorithm>
#include <limits>

#include "core/base/finite.h"

namespace sim {
namespace {

constexpr int kAtOnce = 256;  // steps: what is done once a call is little beside them

std::uint16_t slot(int number) { return static_cast<std::uint16_t>(number); }

int weights_of(const ExplicitPlan& plan) {
  const auto count = [](const std::vector<double>& weights) {
    return static_cast<int>(weights.size() -
                            static_cast<std::size_t>(std::ranges::count(weights, 0.0)));
  };
  return count(plan.a) + count(plan.b);
}

}  // namespace

// Slots: x, y, x_next, k of each stage, t of each stage, constants, registers, weights times h.
bool StraightStepper::fits(const Code& code, const ExplicitPlan& plan) {
  constexpr std::size_t kMostInstructions = 20000;
  const int numbers = (3 + plan.stages) * code.outputs + plan.stages +
                      static_cast<int>(code.constants.size()) + code.registers + weights_of(plan);
  return numbers <= std::numeric_limits<std::uint16_t>::max() &&
         code.instructions.size() * static_cast<std::size_t>(plan.stages) <= kMostInstructions;
}

StraightStepper::StraightStepper(const Code& code, const ExplicitPlan& plan)
    : plan_(plan),
      size_(code.outputs),
      at_once_(code.reads.back() ? 1 : kAtOnce),  // what reads t is told the time of each step
      y_(size_),
      next_(2 * size_),
      k_(3 * size_),
      times_(k_ + plan.stages * size_),
      constants_(times_ + plan.stages),
      registers_(constants_ + static_cast<int>(code.constants.size())) {
  slots_.resize(static_cast<std::size_t>(registers_ + code.registers), 0);
  std::ranges::copy(code.constants, slots_.begin() + constants_);
  for (int stage = 0; stage < plan.stages; ++stage) add_stage(code, stage);
  const int sum = add_sum(plan.b.data(), plan.stages, next_);
  for (int i = 0; i < size_; ++i)
    instructions_.push_back({Op::kCopy, slot(x_ + i), {slot(sum + i), 0, 0}});
}

int StraightStepper::add_sum(const double* weights, int count, int y) {
  int from = x_;
  for (int j = 0; j < count; ++j) {
    if (weights[j] == 0) continue;
    const int weight = static_cast<int>(slots_.size());
    weights_.push_back({weight, weights[j]});
    slots_.push_back(0);
    for (int i = 0; i < size_; ++i)
      instructions_.push_back({Op::kProductPlus,
                               slot(y + i),
                               {slot(weight), slot(k_ + j * size_ + i), slot(from + i)}});
    from = y;
  }
  return from;
}

void StraightStepper::add_stage(const Code& code, int stage) {
  const int point = add_sum(&plan_.a[static_cast<std::size_t>(stage * plan_.stages)], stage, y_);
  const auto moved = [&](int number) {
    if (number < size_) return point + number;
    if (number < code.inputs) return times_ + stage;
    if (number < code.first_constant()) return k_ + stage * size_ + number - code.inputs;
    if (number < code.first_register()) return constants_ + number - code.first_constant();
    return registers_ + number - code.first_register();
  };
  for (Instruction now : code.instructions) {
    now.to = slot(moved(now.to));
    for (int i = 0; i < operand_count(now.op); ++i) now.operand[i] = slot(moved(now.operand[i]));
    instructions_.push_back(now);
  }
}

bool StraightStepper::step(double t, double h, int count, const double* x, double* x_next) {
  if (h != h_)
    for (const Weight& weight : weights_)
      slots_[static_cast<std::size_t>(weight.slot)] = h * weight.value;
  h_ = h;
  for (int stage = 0; stage < plan_.stages; ++stage)
    slots_[static_cast<std::size_t>(times_ + stage)] =
        t + plan_.c[static_cast<std::size_t>(stage)] * h;
  std::copy_n(x, size_, slots_.data() + x_);
  for (int i = 0; i < count; ++i) run_(instructions_, slots_.data());
  std::copy_n(slots_.data() + x_, size_, x_next);
  return all_finite({x_next, static_cast<std::size_t>(size_)});
}

}  // namespace sim
