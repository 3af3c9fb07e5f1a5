#include "core/expression/program.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/base/assert.h"

namespace sim {
namespace {

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

// A node on its way to an instruction.
struct Operation {
  Op op = Op::kNumber;
  int operand[3] = {-1, -1, -1};  // ids
  bool joined = false;            // a part of the one that reads it
};

// The instruction for `outer` of a node and of what `inner` makes, its operand of that number; or
// kCopy: there is none.
Op joined(Op outer, Op inner, int operand) {
  constexpr Op kNone = Op::kCopy;
  const auto among = [&](Op product, Op sum, Op difference) {
    return inner == Op::kMultiply   ? product
           : inner == Op::kAdd      ? sum
           : inner == Op::kSubtract ? difference
                                    : kNone;
  };
  switch (outer) {
    case Op::kAdd:
      return among(Op::kProductPlus, Op::kSumPlus, Op::kDifferencePlus);
    case Op::kSubtract:
      return operand == 0 ? among(Op::kProductMinus, Op::kSumMinus, Op::kDifferenceMinus)
                          : among(Op::kMinusProduct, kNone, kNone);
    case Op::kMultiply:
      return among(Op::kProductTimes, Op::kSumTimes, Op::kDifferenceTimes);
    default:
      return kNone;
  }
}

// Two operations of which the second alone reads the first are one instruction, with the same bits.
void join_pairs(const Graph& graph, const std::vector<bool>& used, std::span<const int> outputs,
                std::vector<Operation>& operations) {
  std::vector<int> readers(operations.size(), 0);
  for (const int id : outputs) ++readers[static_cast<std::size_t>(id)];
  for (std::size_t id = 0; id < operations.size(); ++id) {
    if (!used[id]) continue;
    const Node& node = graph[static_cast<int>(id)];
    operations[id].op = node.op;
    for (int i = 0; i < operand_count(node.op); ++i) {
      operations[id].operand[i] = node.operand[i];
      ++readers[static_cast<std::size_t>(node.operand[i])];
    }
  }
  for (std::size_t id = 0; id < operations.size(); ++id) {
    Operation& outer = operations[id];
    if (!used[id] || operand_count(outer.op) != 2) continue;
    int best = -1;
    for (const int i : {0, 1}) {
      const auto from = static_cast<std::size_t>(outer.operand[i]);
      const Op inner = operations[from].op;
      if (readers[from] != 1 || joined(outer.op, inner, i) == Op::kCopy) continue;
      if (best < 0 || inner == Op::kMultiply) best = i;
    }
    if (best < 0) continue;
    Operation& inner = operations[static_cast<std::size_t>(outer.operand[best])];
    inner.joined = true;
    outer = {joined(outer.op, inner.op, best),
             {inner.operand[0], inner.operand[1], outer.operand[1 - best]}};
  }
}

}  // namespace

Code::Code(const Graph& graph, std::span<const int> roots, int input_count)
    : reads(static_cast<std::size_t>(input_count), false),
      inputs(input_count),
      outputs(static_cast<int>(roots.size())) {
  const std::vector<bool> used = graph.used_by(roots);
  const auto nodes = static_cast<int>(used.size());
  std::vector<int> slot(used.size(), -1), last(used.size(), -1);
  const auto slot_of = [&](int id) -> int& { return slot[static_cast<std::size_t>(id)]; };
  const auto last_of = [&](int id) -> int& { return last[static_cast<std::size_t>(id)]; };
  std::vector<Operation> operations(used.size());
  join_pairs(graph, used, roots, operations);
  const auto skipped = [&](int id) {
    const auto at = static_cast<std::size_t>(id);
    return !used[at] || operations[at].joined;
  };

  // Constants, and who reads a value last.
  for (int id = 0; id < nodes; ++id) {
    if (skipped(id)) continue;
    const Node& node = graph[id];
    if (node.op == Op::kInput) {
      reads[static_cast<std::size_t>(node.operand[0])] = true;
      slot_of(id) = node.operand[0];
    } else if (node.op == Op::kNumber) {
      slot_of(id) = first_register();
      constants.push_back(node.number);
    }
    const Operation& operation = operations[static_cast<std::size_t>(id)];
    for (int i = 0; i < operand_count(operation.op); ++i) last_of(operation.operand[i]) = id;
  }

  // The destination of each value: the first output that wants it, or a register.
  for (int i = 0; i < outputs; ++i)
    if (int& to = slot_of(roots[static_cast<std::size_t>(i)]); to < 0) to = inputs + i;
  Registers free;
  for (int id = 0; id < nodes; ++id) {
    const Operation& operation = operations[static_cast<std::size_t>(id)];
    const int operands = operand_count(operation.op);
    if (skipped(id) || operands == 0) continue;
    Instruction now{operation.op, 0, {0, 0, 0}};
    for (int i = 0; i < operands; ++i) {
      const int from = slot_of(operation.operand[i]);
      SIM_ASSERT(from >= 0);  // operands come before their users
      now.operand[i] = static_cast<std::uint16_t>(from);
      const bool repeated =
          std::count(operation.operand, operation.operand + i, operation.operand[i]) > 0;
      if (from >= first_register() && last_of(operation.operand[i]) == id && !repeated)
        free.give_back(from - first_register());
    }
    if (slot_of(id) < 0) slot_of(id) = first_register() + free.take();
    now.to = static_cast<std::uint16_t>(slot_of(id));
    instructions.push_back(now);
  }
  for (int i = 0; i < outputs; ++i)
    if (const int from = slot_of(roots[static_cast<std::size_t>(i)]); from != inputs + i)
      instructions.push_back({Op::kCopy,
                              static_cast<std::uint16_t>(inputs + i),
                              {static_cast<std::uint16_t>(from), 0, 0}});
  registers = free.count();
  if (slots() > std::numeric_limits<std::uint16_t>::max()) refuse_large_code();
}

Program::Program(const Graph& graph, std::span<const int> outputs, int inputs)
    : code_(graph, outputs, inputs) {
  using Operand = VectorCode::Operand;
  std::vector<Operand> slots;
  for (int i = 0; i < code_.first_constant(); ++i)
    slots.push_back({Operand::Kind::kArray, i, 0, 0});
  for (const double constant : code_.constants)
    slots.push_back({Operand::Kind::kUniform, 0, 0, constant});
  slots.resize(static_cast<std::size_t>(code_.slots()));
  vectors_ = VectorCode(code_.instructions, std::move(slots));
}

void Program::run(const double* const* inputs, double* const* outputs, int count) const {
  double* arrays[VectorCode::kMostOperands];
  // Inputs are only read.
  for (int i = 0; i < code_.inputs; ++i) arrays[i] = const_cast<double*>(inputs[i]);
  std::copy_n(outputs, code_.outputs, arrays + code_.inputs);
  vectors_.run(arrays, count);
}

}  // namespace sim
