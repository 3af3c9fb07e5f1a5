// Instructions on arrays of numbers, run over a range of their elements: the right-hand sides of
// the cells of a lattice.
#pragma once

#include <cstddef>
#include <vector>

#include "core/base/array.h"
#include "core/expression/machine.h"
#include "core/expression/x86_code.h"

namespace sim {

// On machines with AVX2 the instructions become a loop of machine code over four or, with AVX-512,
// eight elements at a time, in which values stay in registers. Elsewhere, and if an instruction is
// an elementary function, each is interpreted for a block of elements. The bits are the same: every
// operation is rounded alone.
class VectorCode {
 public:
  enum class Form { kFastest, kInterpreted };

  // An operand or result of instructions, which name it by its number among all of them.
  struct Operand {
    enum class Kind {
      kRegister,  // of one element, from one instruction to the next
      kUniform,   // the same for all elements; instructions only read it
      kArray      // of element i the number i + distance of an array
    };
    Kind kind = Kind::kRegister;
    int array = 0;
    std::ptrdiff_t distance = 0;
    double number = 0;
  };

  VectorCode() = default;
  // Two operands at the same place of an array must be the same, unless both are only read.
  // Throws Error{kScene} if there are too many.
  VectorCode(std::vector<Instruction> code, std::vector<Operand> operands,
             Form form = Form::kFastest);

  void set_uniform(int operand, double number);

  // Runs the instructions for the elements 0 to count - 1. Arrays may be read and written up to the
  // next multiple of 8 elements; one that no instruction names may be null. Allocates nothing; any
  // number of threads at a time.
  void run(double* const* arrays, int count) const;

  // Most operands, and most of them that are registers.
  static constexpr int kMostOperands = 2048, kMostRegisters = 1024;

  bool is_native() const { return native_ != nullptr; }

 private:
  using Native = void(double* const* arrays, const double* numbers, std::ptrdiff_t bytes);

  void interpret(double* const* arrays, int count) const;

  std::vector<Instruction> code_;
  std::vector<Operand> operands_;
  int block_ = 0;           // elements that are interpreted at a time
  int apart_ = 0;           // numbers from a register to the next, interpreted
  std::size_t stride_ = 0;  // from one number to the next
  Array numbers_;           // of the operands, each as often as elements need it
  RunInstructions interpret_ = run_instructions();
  x86::CodePages pages_;
  Native* native_ = nullptr;  // in these pages
};

}  // namespace sim
