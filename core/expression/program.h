// Formulas compiled to a list of vector instructions.
#pragma once

#include <span>
#include <vector>

#include "core/base/array.h"
#include "core/expression/graph.h"
#include "core/expression/machine.h"

namespace sim {

// Evaluates formulas of the same inputs for many elements, a block at a time: each instruction runs
// over the whole block, so that it is decoded once for many.
class Program {
 public:
  static constexpr int kBlock = 64;

  Program() = default;
  // Of the nodes `outputs`; reads inputs 0 to `inputs` - 1. Throws Error{kScene} when the formulas
  // need more memory at a time than a block of 8 has.
  Program(const Graph& graph, std::span<const int> outputs, int inputs);

  // Most elements of one run; a multiple of 8, at most kBlock.
  int block() const { return block_; }
  bool reads(int input) const { return reads_[static_cast<std::size_t>(input)]; }

  // outputs[i][e] := formula i of inputs[...][e] for `count` <= block() elements. All arrays may be
  // read and written up to the next multiple of 8; outputs are arrays of their own. An input that
  // is not read may be null. Allocates nothing; any number of threads at a time.
  void run(const double* const* inputs, double* const* outputs, int count) const;

 private:
  std::vector<Instruction> code_;
  std::vector<bool> reads_;
  Array constants_;  // kBlock times each
  int inputs_ = 0, outputs_ = 0, registers_ = 0, block_ = 8;
  RunInstructions run_ = run_instructions();
};

}  // namespace sim
