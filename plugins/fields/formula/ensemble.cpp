#include "ensemble.h"

#include <algorithm>
#include <bit>
#include <cstdint>

#include "core/base/finite.h"

namespace sim {
namespace {

constexpr std::size_t kVector = 8;  // numbers that instructions take at a time, at least

bool same(const Instruction& a, const Instruction& b) {
  return a.op == b.op && a.to == b.to && std::ranges::equal(a.operand, b.operand);
}

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

}  // namespace

bool same_operations(const Code& a, const Code& b) {
  return a.inputs == b.inputs && a.outputs == b.outputs && a.registers == b.registers &&
         a.constants.size() == b.constants.size() &&
         std::ranges::equal(a.instructions, b.instructions, same);
}

// Unused lanes repeat the first one.
Ensemble::Ensemble(std::vector<Lane> lanes, double h)
    : lanes_(std::move(lanes)),
      size_(lanes_.front().start.size()),
      width_((lanes_.size() + kVector - 1) / kVector * kVector),
      h_(h),
      start_(size_ * width_) {
  for (std::size_t lane = 0; lane < width_; ++lane) {
    const std::span<const double> from = lanes_[lane < lanes_.size() ? lane : 0].start;
    able_ = able_ && from.size() == size_;
    for (std::size_t i = 0; able_ && i < size_; ++i) start_[i * width_ + lane] = from[i];
  }
  for (const Lane& lane : lanes_)
    positions_.push_back({0, std::vector<double>(lane.start.begin(), lane.start.end())});
  before_ = positions_;
  // Formulas that do not read t take many steps at once.
  constexpr int kLegSteps = 8;
  if (!lanes_.front().code->reads.back()) leg_steps_ = kLegSteps;
}

// The instructions of a step, with every slot as wide as there are lanes.
bool Ensemble::prepare(const ExplicitPlan& plan) {
  if (program_) return true;
  const Code& code = *lanes_.front().code;
  if (!StraightStepper::fits(code, plan)) return false;
  program_.emplace(code, plan.stages, StageProgram::Steps::kEqual);
  add_step(*program_, plan);
  instructions_ = program_->take();
  const std::size_t count = program_->all_slots().size();
  numbers_.assign(count * width_, 0);
  for (std::size_t slot = 0; slot < count; ++slot)
    slots_.push_back(numbers_.data() + slot * width_);
  const auto first = static_cast<std::size_t>(program_->first_constant());
  for (std::size_t lane = 0; lane < width_; ++lane) {
    const Code& own = *lanes_[lane < lanes_.size() ? lane : 0].code;
    for (std::size_t i = 0; i < own.constants.size(); ++i)
      slots_[first + i][lane] = own.constants[i];
  }
  return true;
}

// Formulas that read t get the time of each step.
void Ensemble::add_leg(double t, double h, const ExplicitPlan& plan) {
  program_->set_step(h);
  const auto fill = [&](std::size_t slot, double value) {
    std::fill_n(slots_[slot], width_, value);
  };
  for (std::size_t slot = program_->first_weight(); slot < slots_.size(); ++slot)
    fill(slot, program_->all_slots()[slot]);
  for (int stage = 0; stage < plan.stages; ++stage)
    fill(static_cast<std::size_t>(program_->time(stage)),
         t + plan.c[static_cast<std::size_t>(stage)] * h);
  std::ranges::copy(legs_.empty() ? start_ : legs_.back().to, numbers_.begin());
  for (int i = 0; i < leg_steps_; ++i) run_(instructions_, slots_.data(), static_cast<int>(width_));
  const auto end = numbers_.begin() + static_cast<std::ptrdiff_t>(size_ * width_);
  legs_.push_back({t, {numbers_.begin(), end}});
}

std::optional<int> Ensemble::advance(std::size_t lane, const ExplicitPlan& plan, double t, double h,
                                     int count, const double* x, double* x_next) {
  if (!able_ || h != h_ || !prepare(plan)) return {};
  const auto is_at = [&](const Position& position) {
    return std::equal(x, x + size_, position.x.begin(), same_bits);
  };
  Position &from = positions_[lane], &before = before_[lane];
  if (!is_at(from)) {
    if (!is_at(before)) return {};
    from = before;
  }
  const std::int64_t whole = (from.steps + count) / leg_steps_, known = whole * leg_steps_;
  if (known <= from.steps) return 0;
  const auto legs = static_cast<std::size_t>(whole);
  if (legs * size_ * width_ > kMostNumbers) return {};
  while (legs_.size() < legs) add_leg(t, h, plan);
  const Leg& leg = legs_[legs - 1];
  if (leg_steps_ == 1 && leg.t != t) return {};
  for (std::size_t i = 0; i < size_; ++i) x_next[i] = leg.to[i * width_ + lane];
  if (!all_finite({x_next, size_})) return {};
  return static_cast<int>(known - from.steps);
}

void Ensemble::arrive(std::size_t lane, int steps, const double* x) {
  before_[lane] = positions_[lane];
  positions_[lane].steps += steps;
  std::copy_n(x, size_, positions_[lane].x.begin());
}

}  // namespace sim
