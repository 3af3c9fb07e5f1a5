#include <limits>

#include "core/expression/machine.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "core/expression/machine_kernel.cpp"
#include "core/simd/foreach_target.h"

#include "core/expression/functions_kernel.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

SIM_INLINE Doubles min_of(Doubles a, Doubles b) { return ((a <= b) | (a != a)) ? a : b; }
SIM_INLINE Doubles max_of(Doubles a, Doubles b) { return ((a >= b) | (a != a)) ? a : b; }
SIM_INLINE Doubles step_of(Doubles a) {
  const Doubles known = a < splat<double>(0) ? splat<double>(0) : splat<double>(1);
  return a == a ? known : a;
}
SIM_INLINE Doubles sign_of(Doubles a) {
  const Doubles above = a > splat<double>(0) ? splat<double>(1) : a;  // 0 and not a number stay
  return a < splat<double>(0) ? splat<double>(-1) : above;
}
SIM_INLINE Doubles select_of(Doubles a, Doubles b, Doubles c) {
  const Doubles chosen = a != splat<double>(0) ? b : c;
  return a == a ? chosen : a;
}

template <class F>
SIM_INLINE void each(double* to, int count, const double* a, F f) {
  for (int i = 0; i < count; i += kDoubles) store(to + i, f(load(a + i)));
}
template <class F>
SIM_INLINE void each(double* to, int count, const double* a, const double* b, F f) {
  for (int i = 0; i < count; i += kDoubles) store(to + i, f(load(a + i), load(b + i)));
}

template <class F>
SIM_INLINE void each(double* to, int count, const double* a, const double* b, const double* c,
                     F f) {
  for (int i = 0; i < count; i += kDoubles) store(to + i, f(load(a + i), load(b + i), load(c + i)));
}

void run_code(std::span<const Instruction> code, double* const* slots, int count) {
  for (const Instruction& now : code) {
    double* const to = slots[now.to];
    const double *const a = slots[now.operand[0]], *const b = slots[now.operand[1]],
                        *const c = slots[now.operand[2]];
#define SIM_UNARY(op, f)                                                           \
  case Op::op:                                                                     \
    each(                                                                          \
        to, count, a, [](Doubles x) __attribute__((always_inline)) { return f; }); \
    break;
#define SIM_BINARY(op, f)                                                                        \
  case Op::op:                                                                                   \
    each(                                                                                        \
        to, count, a, b, [](Doubles x, Doubles y) __attribute__((always_inline)) { return f; }); \
    break;
#define SIM_TERNARY(op, f)                                                                 \
  case Op::op:                                                                             \
    each(                                                                                  \
        to, count, a, b, c,                                                                \
        [](Doubles x, Doubles y, Doubles z) __attribute__((always_inline)) { return f; }); \
    break;
    switch (now.op) {
      SIM_UNARY(kCopy, x)
      SIM_UNARY(kNegate, -x)
      SIM_UNARY(kAbs, magnitude(x))
      SIM_UNARY(kSign, sign_of(x))
      SIM_UNARY(kStep, step_of(x))
      SIM_UNARY(kFloor, floor_of(x))
      SIM_UNARY(kPositive, x > splat<double>(0) ? x : not_a_number())
      SIM_UNARY(kSqrt, square_root(x))
      SIM_UNARY(kExp, exp_of(x))
      SIM_UNARY(kLog, log_of(x))
      SIM_UNARY(kSin, sine_cosine(x).sine)
      SIM_UNARY(kCos, sine_cosine(x).cosine)
      SIM_UNARY(kTan, tan_of(x))
      SIM_UNARY(kSinh, sinh_of(x))
      SIM_UNARY(kCosh, cosh_of(x))
      SIM_UNARY(kTanh, tanh_of(x))
      SIM_BINARY(kAdd, x + y)
      SIM_BINARY(kSubtract, x - y)
      SIM_BINARY(kMultiply, x * y)
      SIM_BINARY(kDivide, x / y)
      SIM_BINARY(kMin, min_of(x, y))
      SIM_BINARY(kMax, max_of(x, y))
      SIM_BINARY(kPower, exp_of(y * log_of(x)))
      SIM_TERNARY(kSelect, select_of(x, y, z))
      SIM_TERNARY(kProductPlus, x * y + z)
      SIM_TERNARY(kProductMinus, x * y - z)
      SIM_TERNARY(kMinusProduct, z - x * y)
      SIM_TERNARY(kSumPlus, (x + y) + z)
      SIM_TERNARY(kSumMinus, (x + y) - z)
      SIM_TERNARY(kDifferencePlus, (x - y) + z)
      SIM_TERNARY(kDifferenceMinus, (x - y) - z)
      SIM_TERNARY(kProductTimes, (x * y) * z)
      SIM_TERNARY(kSumTimes, (x + y) * z)
      SIM_TERNARY(kDifferenceTimes, (x - y) * z)
      case Op::kNumber:
      case Op::kInput:
        break;
    }
#undef SIM_UNARY
#undef SIM_BINARY
#undef SIM_TERNARY
  }
}

void run_numbers(std::span<const Instruction> code, double* slots) {
  for (const Instruction& now : code) {
    const double a = slots[now.operand[0]], b = slots[now.operand[1]], c = slots[now.operand[2]];
    double& to = slots[now.to];
#define SIM_PLAIN(op, f) \
  case Op::op:           \
    to = f;              \
    break;
#define SIM_VECTOR(op, f)                                                           \
  case Op::op: {                                                                    \
    const Doubles x = splat<double>(a), y = splat<double>(b), z = splat<double>(c); \
    static_cast<void>(y), static_cast<void>(z);                                     \
    to = (f)[0];                                                                    \
    break;                                                                          \
  }
    switch (now.op) {
      SIM_PLAIN(kCopy, a)
      SIM_PLAIN(kNegate, -a)
      SIM_VECTOR(kAbs, magnitude(x))
      SIM_VECTOR(kSign, sign_of(x))
      SIM_VECTOR(kStep, step_of(x))
      SIM_VECTOR(kFloor, floor_of(x))
      SIM_PLAIN(kPositive, a > 0 ? a : std::numeric_limits<double>::quiet_NaN())
      SIM_VECTOR(kSqrt, square_root(x))
      SIM_VECTOR(kExp, exp_of(x))
      SIM_VECTOR(kLog, log_of(x))
      SIM_VECTOR(kSin, sine_cosine(x).sine)
      SIM_VECTOR(kCos, sine_cosine(x).cosine)
      SIM_VECTOR(kTan, tan_of(x))
      SIM_VECTOR(kSinh, sinh_of(x))
      SIM_VECTOR(kCosh, cosh_of(x))
      SIM_VECTOR(kTanh, tanh_of(x))
      SIM_PLAIN(kAdd, a + b)
      SIM_PLAIN(kSubtract, a - b)
      SIM_PLAIN(kMultiply, a * b)
      SIM_PLAIN(kDivide, a / b)
      SIM_VECTOR(kMin, min_of(x, y))
      SIM_VECTOR(kMax, max_of(x, y))
      SIM_VECTOR(kPower, exp_of(y * log_of(x)))
      SIM_VECTOR(kSelect, select_of(x, y, z))
      SIM_PLAIN(kProductPlus, a * b + c)
      SIM_PLAIN(kProductMinus, a * b - c)
      SIM_PLAIN(kMinusProduct, c - a * b)
      SIM_PLAIN(kSumPlus, (a + b) + c)
      SIM_PLAIN(kSumMinus, (a + b) - c)
      SIM_PLAIN(kDifferencePlus, (a - b) + c)
      SIM_PLAIN(kDifferenceMinus, (a - b) - c)
      SIM_PLAIN(kProductTimes, (a * b) * c)
      SIM_PLAIN(kSumTimes, (a + b) * c)
      SIM_PLAIN(kDifferenceTimes, (a - b) * c)
      case Op::kNumber:
      case Op::kInput:
        break;
    }
#undef SIM_PLAIN
#undef SIM_VECTOR
  }
}

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

RunInstructions run_instructions() { return SIM_CHOOSE(run_code); }
RunStraight run_straight() { return SIM_CHOOSE(run_numbers); }

}  // namespace sim
#endif
