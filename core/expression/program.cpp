#include "core/expression/program.h"

#include <algorithm>
#include <string>

#include "core/base/assert.h"
#include "core/base/error.h"

namespace sim {
namespace {

constexpr std::size_t kScratch = 8192;  // numbers in registers, on the stack
constexpr std::size_t kMostSlots = 2048;

[[noreturn]] void too_large() {
  throw Error(ErrorKind::kScene,
              {"bad expression", "", "it and its derivatives need too much memory at a time",
               "write a force of your own, see plugins/README.md"});
}

// Numbers registers so that each is free again after its value was read for the last time.
class Registers {
 public:
  int take() {
    if (free_.empty()) return count_++;
    const int number = free_.back();
    free_.pop_back();
    return number;
  }
  void give_back(int number) { free_.push_back(number); }
  int count() const { return count_; }

 private:
  std::vector<int> free_;
  int count_ = 0;
};

}  // namespace

// Slots in order: inputs, outputs, constants, registers.
Program::Program(const Graph& graph, std::span<const int> outputs, int inputs)
    : reads_(static_cast<std::size_t>(inputs), false),
      inputs_(inputs),
      outputs_(static_cast<int>(outputs.size())) {
  const std::vector<bool> used = graph.used_by(outputs);
  const auto nodes = static_cast<int>(used.size());
  std::vector<int> slot(used.size(), -1), last(used.size(), -1);
  const auto slot_of = [&](int id) -> int& { return slot[static_cast<std::size_t>(id)]; };
  const auto last_of = [&](int id) -> int& { return last[static_cast<std::size_t>(id)]; };

  // Constants, and who reads a value last.
  std::vector<double> numbers;
  for (int id = 0; id < nodes; ++id) {
    if (!used[static_cast<std::size_t>(id)]) continue;
    const Node& node = graph[id];
    if (node.op == Op::kInput) {
      reads_[static_cast<std::size_t>(node.operand[0])] = true;
      slot_of(id) = node.operand[0];
    } else if (node.op == Op::kNumber) {
      slot_of(id) = inputs_ + outputs_ + static_cast<int>(numbers.size());
      numbers.push_back(node.number);
    }
    for (int i = 0; i < operand_count(node.op); ++i) last_of(node.operand[i]) = id;
  }
  constants_ = Array(numbers.size() * kBlock);
  for (std::size_t i = 0; i < constants_.size(); ++i) constants_[i] = numbers[i / kBlock];

  // Where the operations put their values: the first output that wants it, or a register.
  const int first_register = inputs_ + outputs_ + static_cast<int>(numbers.size());
  for (int i = 0; i < outputs_; ++i)
    if (int& to = slot_of(outputs[static_cast<std::size_t>(i)]); to < 0) to = inputs_ + i;
  Registers registers;
  for (int id = 0; id < nodes; ++id) {
    const Node& node = graph[id];
    const int operands = operand_count(node.op);
    if (!used[static_cast<std::size_t>(id)] || operands == 0) continue;
    Instruction now{node.op, 0, {0, 0, 0}};
    for (int i = 0; i < operands; ++i) {
      const int from = slot_of(node.operand[i]);
      SIM_ASSERT(from >= 0);  // operands come before what reads them
      now.operand[i] = static_cast<std::uint16_t>(from);
      const bool repeated = std::count(node.operand, node.operand + i, node.operand[i]) > 0;
      if (from >= first_register && last_of(node.operand[i]) == id && !repeated)
        registers.give_back(from - first_register);
    }
    if (slot_of(id) < 0) slot_of(id) = first_register + registers.take();
    now.to = static_cast<std::uint16_t>(slot_of(id));
    code_.push_back(now);
  }
  for (int i = 0; i < outputs_; ++i)
    if (const int from = slot_of(outputs[static_cast<std::size_t>(i)]); from != inputs_ + i)
      code_.push_back({Op::kCopy,
                       static_cast<std::uint16_t>(inputs_ + i),
                       {static_cast<std::uint16_t>(from), 0, 0}});

  registers_ = registers.count();
  const std::size_t each = kScratch / static_cast<std::size_t>(std::max(registers_, 1)) / 8 * 8;
  if (each < 8 || static_cast<std::size_t>(first_register + registers_) > kMostSlots) too_large();
  block_ = static_cast<int>(std::min(each, static_cast<std::size_t>(kBlock)));
}

void Program::run(const double* const* inputs, double* const* outputs, int count) const {
  alignas(64) double scratch[kScratch];
  double* slots[kMostSlots];
  // Inputs and constants are only read.
  double** slot = slots;
  for (int i = 0; i < inputs_; ++i) *slot++ = const_cast<double*>(inputs[i]);
  for (int i = 0; i < outputs_; ++i) *slot++ = outputs[i];
  for (std::size_t at = 0; at < constants_.size(); at += kBlock)
    *slot++ = const_cast<double*>(constants_.data() + at);
  for (int i = 0; i < registers_; ++i) *slot++ = scratch + i * block_;
  run_(code_, slots, (count + 7) / 8 * 8);
}

}  // namespace sim
