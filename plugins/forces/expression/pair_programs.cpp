#include "pair_programs.h"

#include <optional>
#include <vector>

namespace sim::expression {
namespace {

constexpr int kMissing = -1;

int made_again(Graph& to, const Node& node, const int (&operands)[3]) {
  if (node.op == Op::kNumber) return to.number(node.number);
  if (node.op == Op::kInput) return to.input(node.operand[0]);
  return to.make(node.op, operands[0], operands[1], operands[2]);
}

// A graph made anew from the nodes of another, with the inverse of the first input in quotients.
class Reciprocals {
 public:
  Reciprocals(const Graph& from, std::span<const int> roots, int inverse) {
    const std::vector<bool> used = from.used_by(roots);
    for (int id = 0; id < static_cast<int>(used.size()); ++id) {
      const Node& node = from[id];
      // The inverse is a node where it is asked for; of products, if all their parts have one.
      int reciprocal = kMissing;
      if (node.op == Op::kInput && node.operand[0] == 0) reciprocal = to_.input(inverse);
      if (node.op == Op::kMultiply) {
        const int a = reciprocal_of(node.operand[0]), b = reciprocal_of(node.operand[1]);
        if (a != kMissing && b != kMissing) reciprocal = to_.make(Op::kMultiply, a, b);
      }
      reciprocals_.push_back(reciprocal);
      ids_.push_back(used[static_cast<std::size_t>(id)] ? made(node) : kMissing);
    }
  }

  const Graph& graph() const { return to_; }
  int operator[](int id) const { return ids_[static_cast<std::size_t>(id)]; }

 private:
  int reciprocal_of(int id) const { return reciprocals_[static_cast<std::size_t>(id)]; }

  int made(const Node& node) {
    int operands[3] = {kMissing, kMissing, kMissing};
    for (int i = 0; i < operand_count(node.op); ++i) operands[i] = (*this)[node.operand[i]];
    if (node.op == Op::kDivide)
      if (const int reciprocal = reciprocal_of(node.operand[1]); reciprocal != kMissing)
        return to_.make(Op::kMultiply, operands[0], reciprocal);
    return made_again(to_, node, operands);
  }

  Graph to_;
  std::vector<int> ids_, reciprocals_;  // in to_, of the nodes of the other
};

// A formula of r as one of q = r^2, where it is. A node is a formula of q times r^-1, r^0 or r^1.
class OfSquare {
 public:
  // of: the formula, whose first input is r.
  OfSquare(const Graph& from, int of) {
    const std::vector<bool> used = from.used_by({&of, 1});
    for (int id = 0; id <= of; ++id)
      terms_.push_back(used[static_cast<std::size_t>(id)] ? made(from[id]) : std::nullopt);
    if (terms_.back() && terms_.back()->power == 0) root_ = terms_.back()->factor;
  }

  Graph& graph() { return to_; }
  std::optional<int> root() const { return root_; }  // none: not of r^2 alone

 private:
  struct Term {
    int factor, power;
  };

  // factor r^power, for powers from -2 to 2.
  Term reduced(int factor, int power) {
    if (power == 2) return {to_.make(Op::kMultiply, factor, to_.input(0)), 0};
    if (power == -2) return {to_.make(Op::kDivide, factor, to_.input(0)), 0};
    return {factor, power};
  }

  std::optional<Term> made(const Node& node) {
    if (node.op == Op::kInput && node.operand[0] == 0) return Term{to_.number(1), 1};
    std::optional<Term> terms[3];
    int factors[3] = {kMissing, kMissing, kMissing};
    bool even = true;
    for (int i = 0; i < operand_count(node.op); ++i) {
      terms[i] = terms_[static_cast<std::size_t>(node.operand[i])];
      if (!terms[i]) return std::nullopt;
      factors[i] = terms[i]->factor;
      even = even && terms[i]->power == 0;
    }
    if (even) return Term{made_again(to_, node, factors), 0};
    switch (node.op) {
      case Op::kNegate:
      case Op::kAbs:
        return Term{to_.make(node.op, factors[0]), terms[0]->power};
      case Op::kMultiply:
        return reduced(to_.make(node.op, factors[0], factors[1]),
                       terms[0]->power + terms[1]->power);
      case Op::kDivide:
        return reduced(to_.make(node.op, factors[0], factors[1]),
                       terms[0]->power - terms[1]->power);
      case Op::kAdd:
      case Op::kSubtract:
        if (terms[0]->power != terms[1]->power) return std::nullopt;
        return Term{to_.make(node.op, factors[0], factors[1]), terms[0]->power};
      default:
        return std::nullopt;
    }
  }

  Graph to_;
  std::vector<std::optional<Term>> terms_;
  std::optional<int> root_;
};

Program compiled(const Graph& graph, int root, int inputs) {
  const Reciprocals reciprocals(graph, {&root, 1}, inputs);
  const int id = reciprocals[root];
  return {reciprocals.graph(), {&id, 1}, inputs + 1};
}

}  // namespace

PairPrograms::PairPrograms(const Formulas& formulas, int of) {
  OfSquare square(formulas.graph, of);
  of_square = square.root().has_value();
  Graph graph = of_square ? square.graph() : formulas.graph;
  const int root = square.root().value_or(of);
  int slope = graph.derivative(root, 0);
  if (of_square) slope = graph.make(Op::kMultiply, graph.number(2), slope);
  energy = compiled(graph, root, formulas.inputs());
  factor = compiled(graph, slope, formulas.inputs());
}

}  // namespace sim::expression
