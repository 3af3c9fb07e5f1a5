// Formulas compiled to a list of vector instructions.
#pragma once

#include <span>
#include <vector>

#include "core/expression/graph.h"
#include "core/expression/machine.h"
#include "core/expression/vector_code.h"

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

// Evaluates formulas of the same inputs for many elements, a block at a time.
class Program {
 public:
  static constexpr int kBlock = 128;

  Program() = default;
  // Code for the nodes `outputs`; it reads inputs 0 to `inputs` - 1. Throws Error{kScene} when the
  // formulas need too much memory at a time.
  Program(const Graph& graph, std::span<const int> outputs, int inputs);

  bool reads(int input) const { return code_.reads[static_cast<std::size_t>(input)]; }

  // outputs[i][e] := formula i of inputs[...][e] for `count` elements. All arrays may be read and
  // written up to the next multiple of 8; outputs are arrays of their own. An input that is not
  // read may be null. Allocates nothing; any number of threads at a time.
  void run(const double* const* inputs, double* const* outputs, int count) const;

 private:
  Code code_;
  VectorCode vectors_;  // its arrays: inputs, then outputs
};

}  // namespace sim
