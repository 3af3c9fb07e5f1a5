#include "inverse_distance.h"

#include <vector>

namespace sim::expression {
namespace {

// A graph made anew from the nodes of another, in their order.
class Rewriting {
 public:
  Rewriting(const Graph& from, std::span<const int> roots, int inverse) {
    const std::vector<bool> used = from.used_by(roots);
    for (int id = 0; id < static_cast<int>(used.size()); ++id) {
      const Node& node = from[id];
      // The inverse of r is a node where it is asked for; of products, if all their parts have one.
      int reciprocal = kNone;
      if (node.op == Op::kInput && node.operand[0] == 0) reciprocal = to_.input(inverse);
      if (node.op == Op::kMultiply) {
        const int a = reciprocal_of(node.operand[0]), b = reciprocal_of(node.operand[1]);
        if (a != kNone && b != kNone) reciprocal = to_.make(Op::kMultiply, a, b);
      }
      reciprocals_.push_back(reciprocal);
      ids_.push_back(used[static_cast<std::size_t>(id)] ? made(node) : kNone);
    }
  }

  const Graph& graph() const { return to_; }
  int operator[](int id) const { return ids_[static_cast<std::size_t>(id)]; }

 private:
  static constexpr int kNone = -1;

  int reciprocal_of(int id) const { return reciprocals_[static_cast<std::size_t>(id)]; }

  int made(const Node& node) {
    if (node.op == Op::kNumber) return to_.number(node.number);
    if (node.op == Op::kInput) return to_.input(node.operand[0]);
    int operands[3] = {kNone, kNone, kNone};
    for (int i = 0; i < operand_count(node.op); ++i) operands[i] = (*this)[node.operand[i]];
    if (node.op == Op::kDivide)
      if (const int reciprocal = reciprocal_of(node.operand[1]); reciprocal != kNone)
        return to_.make(Op::kMultiply, operands[0], reciprocal);
    return to_.make(node.op, operands[0], operands[1], operands[2]);
  }

  Graph to_;
  std::vector<int> ids_, reciprocals_;  // in to_, of the nodes of the other
};

}  // namespace

Program with_inverse_distance(const Formulas& formulas, std::span<const int> outputs) {
  const Rewriting rewriting(formulas.graph, outputs, formulas.inputs());
  std::vector<int> roots;
  for (const int id : outputs) roots.push_back(rewriting[id]);
  return {rewriting.graph(), roots, formulas.inputs() + 1};
}

}  // namespace sim::expression
