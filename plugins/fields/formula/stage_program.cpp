#include "stage_program.h"

#include <algorithm>
#include <limits>

namespace sim {
namespace {

std::uint16_t slot(int number) { return static_cast<std::uint16_t>(number); }

std::span<const double> row_of(const ExplicitPlan& plan, int stage) {
  return std::span(plan.a).subspan(static_cast<std::size_t>(stage * plan.stages),
                                   static_cast<std::size_t>(stage));
}

}  // namespace

bool StageProgram::fits(const Code& code, int stages, int weights, int scratch) {
  constexpr std::size_t kMostInstructions = 20000;
  const int numbers = (3 + stages) * code.outputs + stages +
                      static_cast<int>(code.constants.size()) + code.registers + scratch + 1 +
                      2 * weights;
  return numbers <= std::numeric_limits<std::uint16_t>::max() &&
         code.instructions.size() * static_cast<std::size_t>(stages) <= kMostInstructions;
}

StageProgram::StageProgram(const Code& code, int stages, Steps steps, int scratch)
    : code_(code),
      steps_(steps),
      size_(code.outputs),
      y_(size_),
      next_(2 * size_),
      k_(3 * size_),
      times_(k_ + stages * size_),
      constants_(times_ + stages),
      registers_(constants_ + static_cast<int>(code.constants.size())),
      scratch_(registers_ + code.registers),
      h_(scratch_ + scratch) {
  slots_.resize(static_cast<std::size_t>(h_) + 1, 0);
  std::ranges::copy(code.constants, slots_.begin() + constants_);
}

// A few numbers at a time, whose sums stay in registers.
int StageProgram::add_sum(std::span<const double> weights, int from, int to) {
  constexpr int kAtOnce = 8;
  const auto first = static_cast<int>(slots_.size());
  const bool changing = steps_ == Steps::kChanging;
  for (const double weight : weights) {
    if (weight == 0) continue;
    slots_.push_back(0);
    if (changing)
      slots_.push_back(weight);
    else
      weights_.push_back(weight);
  }
  if (static_cast<int>(slots_.size()) == first) return from;
  for (int begin = 0; begin < size_; begin += kAtOnce) {
    const int end = std::min(begin + kAtOnce, size_);
    int weight = first, sum = from;
    for (std::size_t j = 0; j < weights.size(); ++j) {
      if (weights[j] == 0) continue;
      const int slope = k(static_cast<int>(j));
      if (changing && begin == 0)
        instructions_.push_back({Op::kMultiply, slot(weight), {slot(weight + 1), slot(h_), 0}});
      for (int i = begin; i < end; ++i) {
        if (sum == kNothing)
          instructions_.push_back(
              {Op::kMultiply, slot(to + i), {slot(weight), slot(slope + i), 0}});
        else
          instructions_.push_back(
              {Op::kProductPlus, slot(to + i), {slot(weight), slot(slope + i), slot(sum + i)}});
      }
      sum = to;
      weight += changing ? 2 : 1;
    }
  }
  return to;
}

void StageProgram::add(Op op, int to, std::array<int, 3> operand, unsigned fixed) {
  for (int i = 0; i < size_; ++i) {
    Instruction now{op, slot(to + i), {}};
    for (int j = 0; j < operand_count(op); ++j)
      now.operand[j] = slot(operand[static_cast<std::size_t>(j)] + (fixed >> j & 1U ? 0 : i));
    instructions_.push_back(now);
  }
}

void StageProgram::add_largest(int from, int to) {
  instructions_.push_back({Op::kCopy, slot(to), {slot(from), 0, 0}});
  for (int i = 1; i < size_; ++i)
    instructions_.push_back({Op::kMax, slot(to), {slot(to), slot(from + i), 0}});
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
  double& now = slots_[static_cast<std::size_t>(h_)];
  if (h == now) return;
  now = h;
  double* const products = slots_.data() + first_weight();
  for (std::size_t i = 0; i < weights_.size(); ++i) products[i] = h * weights_[i];
}

void add_step(StageProgram& program, const ExplicitPlan& plan) {
  for (int stage = 0; stage < plan.stages; ++stage) program.add_stage(row_of(plan, stage), stage);
  program.add_copy(program.add_sum(plan.b, program.next()), program.x());
}

}  // namespace sim
