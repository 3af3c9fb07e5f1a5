// Formulas compiled to a list of vector instructions.
#pragma once

#include <span>
#include <vector>

#include "core/base/array.h"
#include "core/expression/graph.h"
#include "core/expression/machine.h"

namespace sim {

// The instructions of formulas. Slots in order: inputs, outputs, constants, registers.
struct Code {
  // Code for the nodes `outputs`; it reads inputs 0 to `inputs` - 1. Throws Error{kScene} when it
  // needs more slots than an instruction can name.
  Code() = default;
  Code(const Graph& graph, std::span<const int> outputs, int inputs);

  std::vector<Instruction> instructions;
  std::vector<double> constants;
  std::vector<bool> reads;  // of each input
  int inputs = 0, outputs = 0, registers = 0;

  int first_constant() const { return inputs + outputs; }
  int first_register() const { return first_constant() + static_cast<int>(constants.size()); }
  int slots() const { return first_register() + registers; }
};

// Evaluates formulas of the same inputs for many elements, a block at a time: each instruction runs
// over the whole block, so that it is decoded once for many.
class Program {
 public:
  static constexpr int kBlock = 128;

  Program() = default;
  // Code for the nodes `outputs`; it reads inputs 0 to `inputs` - 1. Throws Error{kScene} when the
  // formulas need more memory at a time than a block of 8 has.
  Program(const Graph& graph, std::span<const int> outputs, int inputs);

  // Most elements of one run; a multiple of 8, at most kBlock.
  int block() const { return block_; }
  bool reads(int input) const { return code_.reads[static_cast<std::size_t>(input)]; }

  // outputs[i][e] := formula i of inputs[...][e] for `count` <= block() elements. All arrays may be
  // read and written up to the next multiple of 8; outputs are arrays of their own. An input that
  // is not read may be null. Allocates nothing; any number of threads at a time.
  void run(const double* const* inputs, double* const* outputs, int count) const;

 private:
  Code code_;
  Array constants_;             // kBlock times each
  int block_ = 8, stride_ = 8;  // numbers of a register that are used; from one to the next
  RunInstructions run_ = run_instructions();
};

}  // namespace sim
