#include "core/expression/graph.h"

#include <bit>
#include <cmath>
#include <utility>

#include "core/base/error.h"
#include "core/expression/machine.h"

namespace sim {
namespace {

constexpr int kMostFactors = 64;  // a whole exponent up to this is a product

}  // namespace

int operand_count(Op op) {
  if (op <= Op::kInput) return 0;
  if (op <= Op::kTanh) return 1;
  return op >= Op::kSelect ? 3 : 2;
}

int Graph::add(const Node& node) {
  const Key key{node.op, node.operand[0], node.operand[1], node.operand[2],
                std::bit_cast<std::uint64_t>(node.number)};
  const auto [entry, fresh] = ids_.try_emplace(key, static_cast<int>(nodes_.size()));
  if (!fresh) return entry->second;
  if (nodes_.size() >= kMost)
    throw Error(ErrorKind::kScene,
                {"bad expression", "",
                 "it and its derivatives have more than " + std::to_string(kMost) + " operations",
                 "write a force of your own, see plugins/README.md"});
  nodes_.push_back(node);
  return entry->second;
}

int Graph::number(double value) { return add({Op::kNumber, {-1, -1, -1}, value + 0.0}); }
int Graph::input(int index) { return add({Op::kInput, {index, -1, -1}, 0}); }

bool Graph::is(int id, double value) const { return constant(id) && (*this)[id].number == value; }

int Graph::make(Op op, int a, int b, int c) {
  if (op == Op::kPower) return power(a, b);
  const int operands[] = {a, b, c};
  bool constants = true;
  for (int i = 0; i < operand_count(op); ++i) constants = constants && constant(operands[i]);
  if (constants) return fold(op, a, b, c);
  switch (op) {
    case Op::kNegate:
      if ((*this)[a].op == Op::kNegate) return (*this)[a].operand[0];
      if ((*this)[a].op == Op::kSubtract)
        return sum(op, (*this)[a].operand[1], (*this)[a].operand[0]);
      break;
    case Op::kAdd:
    case Op::kSubtract:
      return sum(op, a, b);
    case Op::kMultiply:
      return product(a, b);
    case Op::kDivide:
      return quotient(a, b);
    case Op::kSelect:
      if (b == c) return b;
      if (constant(a)) return is(a, 0) ? c : b;
      break;
    default:
      break;
  }
  return add({op, {a, b, c}, 0});
}

// The same arithmetic as in a program, so that what is known early has the same bits.
int Graph::fold(Op op, int a, int b, int c) {
  const auto value = [&](int id) { return id < 0 ? 0 : (*this)[id].number; };
  return number(evaluate(op, value(a), value(b), value(c)));
}

// a + b or a - b; kNegate stands for a - b, too.
int Graph::sum(Op op, int a, int b) {
  const bool plus = op == Op::kAdd;
  const auto negated = [&](int id) { return (*this)[id].op == Op::kNegate; };
  if (is(b, 0)) return a;
  if (is(a, 0)) return plus ? b : make(Op::kNegate, b);
  if (negated(b)) return make(plus ? Op::kSubtract : Op::kAdd, a, (*this)[b].operand[0]);
  if (plus && negated(a)) return make(Op::kSubtract, b, (*this)[a].operand[0]);
  if (a == b) return plus ? make(Op::kMultiply, number(2), a) : number(0);
  if (plus && a > b) std::swap(a, b);
  return add({plus ? Op::kAdd : Op::kSubtract, {a, b, -1}, 0});
}

// A constant comes first; those of nested products are multiplied where that does not overflow.
int Graph::product(int a, int b) {
  if (constant(b) || (!constant(a) && a > b)) std::swap(a, b);
  if (is(a, 0)) return a;
  if (is(a, 1)) return b;
  if (is(a, -1)) return make(Op::kNegate, b);
  const Node &left = (*this)[a], right = (*this)[b];
  if (left.op == Op::kNegate && right.op == Op::kNegate)
    return product(left.operand[0], right.operand[0]);
  if (left.op == Op::kNegate) return make(Op::kNegate, product(left.operand[0], b));
  if (right.op == Op::kNegate)
    return constant(a) ? product(number(-left.number), right.operand[0])
                       : make(Op::kNegate, product(a, right.operand[0]));
  if (right.op == Op::kMultiply && constant(right.operand[0])) {
    const int inner = right.operand[0], rest = right.operand[1];
    if (!constant(a)) return product(inner, product(a, rest));
    const double both = left.number * (*this)[inner].number;
    if (std::isnormal(both)) return product(number(both), rest);
  }
  if (left.op == Op::kMultiply && constant(left.operand[0]))
    return product(left.operand[0], product(left.operand[1], b));
  return add({Op::kMultiply, {a, b, -1}, 0});
}

int Graph::quotient(int a, int b) {
  if (is(a, 0) || is(b, 1)) return a;
  if (is(b, -1)) return make(Op::kNegate, a);
  if (constant(b)) {
    // Division by a power of two is exact as a product.
    int exponent = 0;
    const double value = (*this)[b].number, inverse = 1 / value;
    if (std::fabs(std::frexp(value, &exponent)) == 0.5 && std::isnormal(inverse))
      return product(number(inverse), a);
  }
  if ((*this)[a].op == Op::kNegate) return make(Op::kNegate, quotient((*this)[a].operand[0], b));
  return add({Op::kDivide, {a, b, -1}, 0});
}

int Graph::integer_power(int base, int exponent) {
  if (exponent == 0) return number(1);
  if (exponent == 1) return base;
  const int half = integer_power(base, exponent / 2);
  const int square = make(Op::kMultiply, half, half);
  return exponent % 2 ? make(Op::kMultiply, square, base) : square;
}

int Graph::power(int base, int exponent) {
  if (constant(exponent)) {
    // x^n, x^(n + 1/2) = x^n sqrt(x), and their inverses.
    const double value = (*this)[exponent].number, size = std::fabs(value);
    const double whole = std::floor(size);
    if (size <= kMostFactors && (size == whole || size == whole + 0.5)) {
      int result = integer_power(base, static_cast<int>(whole));
      if (size != whole) result = make(Op::kMultiply, result, make(Op::kSqrt, base));
      return value < 0 ? make(Op::kDivide, number(1), result) : result;
    }
    if (constant(base)) return fold(Op::kPower, base, exponent, -1);
  }
  return add({Op::kPower, {base, exponent, -1}, 0});
}

std::vector<bool> Graph::used_by(std::span<const int> roots) const {
  std::vector<bool> used(nodes_.size(), false);
  for (const int root : roots) used[static_cast<std::size_t>(root)] = true;
  for (std::size_t id = nodes_.size(); id-- > 0;)
    if (used[id])
      for (int i = 0; i < operand_count(nodes_[id].op); ++i)
        used[static_cast<std::size_t>(nodes_[id].operand[i])] = true;
  return used;
}

bool Graph::reads(int root, int index) const {
  const std::vector<bool> used = used_by({&root, 1});
  for (std::size_t id = 0; id < used.size(); ++id)
    if (used[id] && nodes_[id].op == Op::kInput && nodes_[id].operand[0] == index) return true;
  return false;
}

int Graph::derivative(int of, int index) {
  // Operands come before what is made of them: one pass in the order of the ids.
  const std::vector<bool> used = used_by({&of, 1});
  const int zero = number(0);
  std::vector<int> slopes(static_cast<std::size_t>(of) + 1, zero);
  for (int id = 0; id <= of; ++id) {
    if (!used[static_cast<std::size_t>(id)]) continue;
    const Node node = (*this)[id];
    int& result = slopes[static_cast<std::size_t>(id)];
    if (node.op == Op::kInput) {
      if (node.operand[0] == index) result = number(1);
      continue;
    }
    int d[3] = {zero, zero, zero};
    bool varies = false;
    for (int i = 0; i < operand_count(node.op); ++i) {
      d[i] = slopes[static_cast<std::size_t>(node.operand[i])];
      varies = varies || d[i] != zero;
    }
    if (varies) result = slope(id, d);
  }
  return slopes[static_cast<std::size_t>(of)];
}

// f = f(a, b, c) with the derivatives d of a, b and c, not all of them 0.
int Graph::slope(int id, const int (&d)[3]) {
  const Node node = (*this)[id];
  const int a = node.operand[0], b = node.operand[1];
  const auto times = [&](int left, int right) { return make(Op::kMultiply, left, right); };
  switch (node.op) {
    case Op::kNegate:
      return make(Op::kNegate, d[0]);
    case Op::kAbs:
      return times(make(Op::kSign, a), d[0]);
    case Op::kSqrt:
      return make(Op::kDivide, times(number(0.5), d[0]), id);
    case Op::kExp:
      return times(id, d[0]);
    case Op::kLog:  // has no slope where it has no value
      return make(Op::kDivide, d[0], make(Op::kPositive, a));
    case Op::kPositive:
      return d[0];
    case Op::kSin:
      return times(make(Op::kCos, a), d[0]);
    case Op::kCos:
      return make(Op::kNegate, times(make(Op::kSin, a), d[0]));
    case Op::kTan:
      return times(make(Op::kAdd, number(1), times(id, id)), d[0]);
    case Op::kSinh:
      return times(make(Op::kCosh, a), d[0]);
    case Op::kCosh:
      return times(make(Op::kSinh, a), d[0]);
    case Op::kTanh:
      return times(make(Op::kSubtract, number(1), times(id, id)), d[0]);
    case Op::kAdd:
    case Op::kSubtract:
      return make(node.op, d[0], d[1]);
    case Op::kMultiply:
      return make(Op::kAdd, times(d[0], b), times(a, d[1]));
    case Op::kDivide:  // (a' - f b') / b
      return make(Op::kDivide, make(Op::kSubtract, d[0], times(id, d[1])), b);
    case Op::kMin:
    case Op::kMax: {
      const int ahead = node.op == Op::kMin ? make(Op::kSubtract, b, a) : make(Op::kSubtract, a, b);
      return make(Op::kSelect, make(Op::kStep, ahead), d[0], d[1]);
    }
    case Op::kPower: {  // b a^(b - 1) a' + log(a) a^b b'
      const int less = power(a, make(Op::kSubtract, b, number(1)));
      return make(Op::kAdd, times(times(b, less), d[0]), times(times(make(Op::kLog, a), id), d[1]));
    }
    case Op::kSelect:
      return make(Op::kSelect, a, d[1], d[2]);
    default:  // steps, signs
      return number(0);
  }
}

}  // namespace sim
