// The operations of expressions on blocks of numbers, in the vectors of this machine.
#pragma once

#include <cstdint>
#include <span>

#include "core/expression/graph.h"

namespace sim {

// slots[to] := op(slots[operand...]); slots are blocks of numbers.
struct Instruction {
  Op op;
  std::uint16_t to, operand[3];
};

// Runs the instructions on the first `count` numbers of every slot, a multiple of 8. Sums,
// products, quotients and square roots are rounded correctly. Elementary functions have the same
// bits on every machine and instruction set, for they consist of those alone; errors, in units in
// the last place:
//   exp 1, log 1, sin and cos 1 for |x| < 1e9 (not a number beyond), tan 3, sinh, cosh and tanh 4,
//   a^b 2 + 2 |b log a|
using RunInstructions = void (*)(std::span<const Instruction> code, double* const* slots,
                                 int count);
RunInstructions run_instructions();

// Runs the code on slots that are single numbers, with the same bits: for systems of a few
// formulas.
using RunStraight = void (*)(std::span<const Instruction> code, double* slots);
RunStraight run_straight();

// Throws Error{kScene}: formulas have more numbers than instructions can name.
[[noreturn]] void refuse_large_code();

// One operation on single numbers, with the same bits.
double evaluate(Op op, double a, double b = 0, double c = 0);

}  // namespace sim
