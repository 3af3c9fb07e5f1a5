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
SIM_INLINE Doubles positive_of(Doubles a) { return a > splat<double>(0) ? a : not_a_number(); }
SIM_INLINE Doubles select_of(Doubles a, Doubles b, Doubles c) {
  const Doubles chosen = a != splat<double>(0) ? b : c;
  return a == a ? chosen : a;
}

// to[i] := f(a[i], ...), eight at a time: the steps from one vector to the next are known then.
template <class F, class... Operands>
SIM_INLINE void each(double* to, int count, F f, const Operands*... from) {
  for (int i = 0; i < count; i += 8)
    for (int half = i; half < i + 8; half += kDoubles) store(to + half, f(load(from + half)...));
}

// The operations, each with its number of operands x, y, z: PLAIN are those of the language, which
// numbers have as well as vectors; VECTOR are functions of vectors alone.
#define SIM_OPERATIONS(PLAIN, VECTOR)     \
  PLAIN(1, kCopy, x)                      \
  PLAIN(1, kNegate, -x)                   \
  VECTOR(1, kAbs, magnitude(x))           \
  VECTOR(1, kSign, sign_of(x))            \
  VECTOR(1, kStep, step_of(x))            \
  VECTOR(1, kFloor, floor_of(x))          \
  VECTOR(1, kPositive, positive_of(x))    \
  VECTOR(1, kSqrt, square_root(x))        \
  VECTOR(1, kExp, exp_of(x))              \
  VECTOR(1, kLog, log_of(x))              \
  VECTOR(1, kSin, sine_cosine(x).sine)    \
  VECTOR(1, kCos, sine_cosine(x).cosine)  \
  VECTOR(1, kTan, tan_of(x))              \
  VECTOR(1, kSinh, sinh_of(x))            \
  VECTOR(1, kCosh, cosh_of(x))            \
  VECTOR(1, kTanh, tanh_of(x))            \
  PLAIN(2, kAdd, x + y)                   \
  PLAIN(2, kSubtract, x - y)              \
  PLAIN(2, kMultiply, x* y)               \
  PLAIN(2, kDivide, x / y)                \
  VECTOR(2, kMin, min_of(x, y))           \
  VECTOR(2, kMax, max_of(x, y))           \
  VECTOR(2, kPower, exp_of(y* log_of(x))) \
  VECTOR(3, kSelect, select_of(x, y, z))  \
  PLAIN(3, kProductPlus, x* y + z)        \
  PLAIN(3, kProductMinus, x* y - z)       \
  PLAIN(3, kMinusProduct, z - x * y)      \
  PLAIN(3, kSumPlus, (x + y) + z)         \
  PLAIN(3, kSumMinus, (x + y) - z)        \
  PLAIN(3, kDifferencePlus, (x - y) + z)  \
  PLAIN(3, kDifferenceMinus, (x - y) - z) \
  PLAIN(3, kProductTimes, (x * y) * z)    \
  PLAIN(3, kSumTimes, (x + y) * z)        \
  PLAIN(3, kDifferenceTimes, (x - y) * z)

void run_code(std::span<const Instruction> code, double* const* slots, int count) {
  for (const Instruction& now : code) {
    double* const to = slots[now.to];
    const double *const a = slots[now.operand[0]], *const b = slots[now.operand[1]],
                        *const c = slots[now.operand[2]];
#define SIM_OPERANDS_1 a
#define SIM_PARAMETERS_1 Doubles x
#define SIM_OPERANDS_2 a, b
#define SIM_PARAMETERS_2 Doubles x, Doubles y
#define SIM_OPERANDS_3 a, b, c
#define SIM_PARAMETERS_3 Doubles x, Doubles y, Doubles z
#define SIM_ALL(n, op, f)                                                               \
  case Op::op:                                                                          \
    each(                                                                               \
        to, count, [](SIM_PARAMETERS_##n) __attribute__((always_inline)) { return f; }, \
        SIM_OPERANDS_##n);                                                              \
    break;
    switch (now.op) {
      SIM_OPERATIONS(SIM_ALL, SIM_ALL)
      case Op::kNumber:
      case Op::kInput:
        break;
    }
#undef SIM_ALL
#undef SIM_OPERANDS_1
#undef SIM_PARAMETERS_1
#undef SIM_OPERANDS_2
#undef SIM_PARAMETERS_2
#undef SIM_OPERANDS_3
#undef SIM_PARAMETERS_3
  }
}

void run_numbers(std::span<const Instruction> code, double* slots) {
  for (const Instruction& now : code) {
    const double a = slots[now.operand[0]], b = slots[now.operand[1]], c = slots[now.operand[2]];
    double& to = slots[now.to];
#define SIM_PLAIN(n, op, f)                            \
  case Op::op: {                                       \
    [[maybe_unused]] const double x = a, y = b, z = c; \
    to = f;                                            \
    break;                                             \
  }
#define SIM_VECTOR(n, op, f)                                                   \
  case Op::op: {                                                               \
    [[maybe_unused]] const Doubles x = splat<double>(a), y = splat<double>(b), \
                                   z = splat<double>(c);                       \
    to = (f)[0];                                                               \
    break;                                                                     \
  }
    switch (now.op) {
      SIM_OPERATIONS(SIM_PLAIN, SIM_VECTOR)
      case Op::kNumber:
      case Op::kInput:
        break;
    }
#undef SIM_PLAIN
#undef SIM_VECTOR
  }
}
#undef SIM_OPERATIONS

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

RunInstructions run_instructions() { return SIM_CHOOSE(run_code); }
RunStraight run_straight() { return SIM_CHOOSE(run_numbers); }

}  // namespace sim
#endif
