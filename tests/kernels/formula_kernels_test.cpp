// Instructions of formulas, compared with the C library one number at a time.
#include <limits>

#include "core/expression/machine.h"
#include "core/expression/program.h"
#include "tests/support/kernel_cases.h"

using namespace sim_test;
using sim::Op;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
const double kNan = std::nan("");

// The exact value of an operation, and the error allowed to the kernel in units in the last place.
struct Exact {
  double value;
  double ulps = 0;
};

Exact exact(Op op, double a, double b, double c) {
  switch (op) {
    case Op::kCopy:
      return {a};
    case Op::kNegate:
      return {-a};
    case Op::kAbs:
      return {std::fabs(a)};
    case Op::kSign:
      return {std::isnan(a) ? a : static_cast<double>((a > 0) - (a < 0))};
    case Op::kStep:
      return {std::isnan(a) ? a : a < 0 ? 0.0 : 1.0};
    case Op::kFloor:
      return {std::floor(a)};
    case Op::kPositive:
      return {a > 0 ? a : kNan};
    case Op::kSqrt:
      return {std::sqrt(a)};
    case Op::kExp:
      return {std::exp(a), 2};
    case Op::kLog:
      return {std::log(a), 2};
    case Op::kSin:
      return {std::fabs(a) < 1e9 ? std::sin(a) : kNan, 2};
    case Op::kCos:
      return {std::fabs(a) < 1e9 ? std::cos(a) : kNan, 2};
    case Op::kTan:
      return {std::fabs(a) < 1e9 ? std::tan(a) : kNan, 4};
    case Op::kSinh:
      return {std::sinh(a), 5};
    case Op::kCosh:
      return {std::cosh(a), 5};
    case Op::kTanh:
      return {std::tanh(a), 5};
    case Op::kAdd:
      return {a + b};
    case Op::kSubtract:
      return {a - b};
    case Op::kMultiply:
      return {a * b};
    case Op::kDivide:
      return {a / b};
    case Op::kMin:
      return {std::isnan(a) || std::isnan(b) ? kNan : std::fmin(a, b)};
    case Op::kMax:
      return {std::isnan(a) || std::isnan(b) ? kNan : std::fmax(a, b)};
    case Op::kPower: {
      const double power = b * std::log(std::fabs(a));
      const bool defined = !std::isnan(power) && a >= 0;
      return {defined ? std::pow(std::fabs(a), b) : kNan, 4 + 2 * std::fabs(power)};
    }
    case Op::kProductPlus:
      return {a * b + c};
    case Op::kProductMinus:
      return {a * b - c};
    case Op::kMinusProduct:
      return {c - a * b};
    case Op::kSumPlus:
      return {(a + b) + c};
    case Op::kSumMinus:
      return {(a + b) - c};
    case Op::kDifferencePlus:
      return {(a - b) + c};
    case Op::kDifferenceMinus:
      return {(a - b) - c};
    case Op::kProductTimes:
      return {(a * b) * c};
    case Op::kSumTimes:
      return {(a + b) * c};
    case Op::kDifferenceTimes:
      return {(a - b) * c};
    default:
      return {std::isnan(a) ? a : a != 0 ? b : c};
  }
}

// Least numbers may be lost where they are smaller than any that is not subnormal.
bool good(double got, const Exact& want) {
  const double size = std::fabs(want.value);
  if (want.ulps == 0 || !std::isfinite(size)) return agree(got, want.value);
  const double ulp = std::nextafter(size, kInfinity) - size;
  return agree(got, want.value, want.ulps * ulp + 1e-300);
}

constexpr int kBlock = 8;  // of what a kernel takes at a time

int padded(int items) { return (items + kBlock - 1) / kBlock * kBlock; }

}  // namespace

TEST_CASE("instructions of formulas give what the C library gives", "[machine_kernel]") {
  const double odd[] = {kNan, kInfinity, -kInfinity, 0.0, -0.0, 1e300, -1e-300, 700.5, -2.5, 1e8};
  for_each_lane([&](int items, int extreme) {
    for (int op = static_cast<int>(Op::kCopy); op <= static_cast<int>(Op::kDifferenceTimes); ++op)
      for (int operand = 0; operand < std::max(1, sim::operand_count(static_cast<Op>(op)));
           ++operand) {
        const int size = padded(items);
        Column slot[4] = {Column(size), Column(size), Column(size), Column(size)};
        for (int k = 0; k < 3; ++k)
          for (int i = 0; i < items; ++i) slot[k][i] = 3 * scattered(i, 10 * op + k) + (k == 0);
        // Another extreme for each number of items, so that all come to each lane.
        slot[operand][extreme] = odd[(items + op) % 10];
        double* const slots[] = {slot[0].data(), slot[1].data(), slot[2].data(), slot[3].data()};
        const sim::Instruction code[] = {{static_cast<Op>(op), 3, {0, 1, 2}}};
        sim::run_instructions()({code, 1}, slots, size);
        for (int i = 0; i < items; ++i) {
          const Exact want = exact(code[0].op, slot[0][i], slot[1][i], slot[2][i]);
          const bool overflows = op == static_cast<int>(Op::kPower) && !std::isfinite(want.value);
          if (!good(slot[3][i], want) && !(overflows && std::isnan(slot[3][i])))
            FAIL_CHECK("operation " << op << " of " << slot[0][i] << ", " << slot[1][i] << ", "
                                    << slot[2][i] << " is " << slot[3][i] << ", not "
                                    << want.value);
        }
        // Single numbers give the same.
        double numbers[] = {slot[0][extreme], slot[1][extreme], slot[2][extreme], 0};
        sim::run_straight()({code, 1}, numbers);
        if (!agree(numbers[3], slot[3][extreme]))
          FAIL_CHECK("operation " << op << " of single numbers is " << numbers[3] << ", not "
                                  << slot[3][extreme]);
        if (slot[3][size] != 7777) FAIL_CHECK("operation " << op << " writes behind its block");
      }
  });
}

TEST_CASE("a compiled formula takes any number of elements", "[machine_kernel]") {
  for_each_lane([](int items, int extreme) {
    sim::Graph graph;
    const int x = graph.input(0), y = graph.input(1);
    const int nodes[] = {graph.make(Op::kAdd, graph.make(Op::kMultiply, x, y), graph.number(2)), x};
    const sim::Program program(graph, nodes, 2);
    const int size = padded(items);
    Column a(size), b(size), sum(size), copy(size), plain(items);
    for (int i = 0; i < items; ++i) {
      a[i] = scattered(i, 0);
      b[i] = scattered(i, 1);
    }
    a[extreme] = 1e200;
    for (int i = 0; i < items; ++i) plain[i] = a[i] * b[i] + 2;
    const double* const in[] = {a.data(), b.data()};
    double* const out[] = {sum.data(), copy.data()};
    program.run(in, out, items);
    bool same = true;
    for (int i = 0; i < items; ++i) same &= sum[i] == plain[i] && copy[i] == a[i];
    CHECK(same);
  });
}
