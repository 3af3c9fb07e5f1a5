// Formulas as a graph of operations in which equal parts are one node, simplified as it is made.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <tuple>
#include <vector>

namespace sim {

// Operations on one, two or three operands; those that give more than the field's standard meaning:
//   kStep      0 for a < 0, else 1;  kSign  -1, 0 or 1
//   kPositive  a for a > 0, else not a number
//   kPower     a^b = e^(b log a), for a > 0 only; whole exponents become products before
//   kSelect    b where a is not 0, else c
// An operand that is not a number gives a result that is not one, wherever it is used.
enum class Op : std::uint8_t {
  kNumber,  // a constant
  kInput,   // a variable, by its index
  kCopy,    // of programs only
  kNegate,
  kAbs,
  kSign,
  kStep,
  kFloor,
  kPositive,
  kSqrt,
  kExp,
  kLog,
  kSin,
  kCos,
  kTan,
  kSinh,
  kCosh,
  kTanh,
  kAdd,
  kSubtract,
  kMultiply,
  kDivide,
  kMin,
  kMax,
  kPower,
  kSelect,
  // Two operations in one, each rounded; of programs only.
  kProductPlus,      // a b + c
  kProductMinus,     // a b - c
  kMinusProduct,     // c - a b
  kSumPlus,          // (a + b) + c
  kSumMinus,         // (a + b) - c
  kDifferencePlus,   // (a - b) + c
  kDifferenceMinus,  // (a - b) - c
  kProductTimes,     // (a b) c
  kSumTimes,         // (a + b) c
  kDifferenceTimes,  // (a - b) c
};

int operand_count(Op op);  // 0 to 3

struct Node {
  Op op;
  int operand[3];  // ids of nodes before this one; the index of an input
  double number;   // of kNumber
};

class Graph {
 public:
  static constexpr std::size_t kMost = 20000;  // nodes

  // Each returns the id of a node, simplified: constants are folded, 0 x = 0 and 1 x = x, so that a
  // term without weight cannot make a sum that is not a number. Throws Error{kScene} when there are
  // more than kMost nodes.
  int number(double value);
  int input(int index);
  int make(Op op, int a, int b = -1, int c = -1);
  int power(int base, int exponent);  // by products and square roots where the exponent allows it

  // d of / d input; of steps and signs 0, also where they jump.
  int derivative(int of, int input);

  const Node& operator[](int id) const { return nodes_[static_cast<std::size_t>(id)]; }
  bool is(int id, double value) const;
  bool constant(int id) const { return (*this)[id].op == Op::kNumber; }

  // The nodes on which `roots` depend, themselves included.
  std::vector<bool> used_by(std::span<const int> roots) const;
  bool reads(int root, int input) const;

 private:
  using Key = std::tuple<Op, int, int, int, std::uint64_t>;

  int add(const Node& node);
  int fold(Op op, int a, int b, int c);
  int sum(Op op, int a, int b);
  int product(int a, int b);
  int quotient(int a, int b);
  int integer_power(int base, int exponent);
  int slope(int id, const int (&d)[3]);  // the derivative of a node from those of its operands

  std::vector<Node> nodes_;
  std::map<Key, int> ids_;
};

}  // namespace sim
