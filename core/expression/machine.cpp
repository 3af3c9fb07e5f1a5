#include "core/expression/machine.h"

#include "core/base/error.h"

namespace sim {

void refuse_large_code() {
  throw Error(ErrorKind::kScene,
              {"bad expression", "", "it and its derivatives need too much memory at a time",
               "write a force of your own, see plugins/README.md"});
}

double evaluate(Op op, double a, double b, double c) {
  constexpr int kCount = 8;
  double blocks[4][kCount];
  double* slots[] = {blocks[0], blocks[1], blocks[2], blocks[3]};
  for (int i = 0; i < kCount; ++i) {
    blocks[0][i] = a;
    blocks[1][i] = b;
    blocks[2][i] = c;
  }
  const Instruction code{op, 3, {0, 1, 2}};
  run_instructions()({&code, 1}, slots, kCount);
  return blocks[3][0];
}

}  // namespace sim
