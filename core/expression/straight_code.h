// Instructions on single numbers, run one after the other: the right-hand sides of small systems.
#pragma once

#include <functional>
#include <vector>

#include "core/expression/machine.h"
#include "core/expression/x86_code.h"

namespace sim {

// On x86-64 the instructions become machine code, where the system lets new code run: values stay
// in registers from one instruction to the next. Elsewhere they are interpreted. The bits are the
// same: each operation is one of the processor's, rounded alone, in the given order, or a call of
// run_straight().
class StraightCode {
 public:
  enum class Form { kFastest, kInterpreted };

  StraightCode() = default;
  // live: the slots that are read after a run; others may have any value then.
  StraightCode(std::vector<Instruction> code, const std::function<bool(int slot)>& live,
               Form form = Form::kFastest);

  void run(double* slots) const {
    if (native_)
      native_(slots);
    else
      interpret_(code_, slots);
  }
  bool is_native() const { return native_ != nullptr; }

 private:
  std::vector<Instruction> code_;
  RunStraight interpret_ = run_straight();
  x86::CodePages pages_;
  void (*native_)(double* slots) = nullptr;  // in these pages
};

}  // namespace sim
