// Numbers that alternate, taken apart and put together, compared with plain loops.
#include "plugins/fields/formula/lattice.h"
#include "tests/support/kernel_cases.h"

using namespace sim_test;

TEST_CASE("pairs of numbers are taken apart and put together", "[lattice_kernel]") {
  for_each_lane([](int items, int extreme) {
    const sim::LatticeKernels kernels = sim::lattice_kernels();
    const auto count = static_cast<std::size_t>(items);
    Column pairs(2 * items), first(items), second(items), again(2 * items);
    for (int i = 0; i < 2 * items; ++i) pairs[i] = scattered(i, 0);
    pairs[2 * extreme] = 1e300;
    kernels.split(pairs.data(), first.data(), second.data(), count);
    kernels.join(first.data(), second.data(), again.data(), count);
    bool same = true;
    for (int i = 0; i < items; ++i)
      same &= first[i] == pairs[2 * i] && second[i] == pairs[2 * i + 1] &&
              again[2 * i] == pairs[2 * i] && again[2 * i + 1] == pairs[2 * i + 1];
    CHECK(same);
    CHECK((first[items] == 7777 && second[items] == 7777 && again[2 * items] == 7777));
  });
}
