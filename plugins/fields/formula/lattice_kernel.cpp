#include "lattice.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "lattice_kernel.cpp"
#include "core/simd/foreach_target.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

#if SIM_BITS == 512
#define SIM_EVEN 0, 2, 4, 6, 8, 10, 12, 14
#define SIM_ODD 1, 3, 5, 7, 9, 11, 13, 15
#define SIM_LOW 0, 8, 1, 9, 2, 10, 3, 11
#define SIM_HIGH 4, 12, 5, 13, 6, 14, 7, 15
#elif SIM_BITS == 256
#define SIM_EVEN 0, 2, 4, 6
#define SIM_ODD 1, 3, 5, 7
#define SIM_LOW 0, 4, 1, 5
#define SIM_HIGH 2, 6, 3, 7
#else
#define SIM_EVEN 0, 2
#define SIM_ODD 1, 3
#define SIM_LOW 0, 2
#define SIM_HIGH 1, 3
#endif

void split(const double* pairs, double* first, double* second, std::size_t count) {
  constexpr std::size_t lanes = kDoubles;
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    const Doubles low = load(pairs + 2 * i), high = load(pairs + 2 * i + lanes);
    store(first + i, __builtin_shufflevector(low, high, SIM_EVEN));
    store(second + i, __builtin_shufflevector(low, high, SIM_ODD));
  }
  for (; i < count; ++i) {
    first[i] = pairs[2 * i];
    second[i] = pairs[2 * i + 1];
  }
}

void join(const double* first, const double* second, double* pairs, std::size_t count) {
  constexpr std::size_t lanes = kDoubles;
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    const Doubles a = load(first + i), b = load(second + i);
    store(pairs + 2 * i, __builtin_shufflevector(a, b, SIM_LOW));
    store(pairs + 2 * i + lanes, __builtin_shufflevector(a, b, SIM_HIGH));
  }
  for (; i < count; ++i) {
    pairs[2 * i] = first[i];
    pairs[2 * i + 1] = second[i];
  }
}

#undef SIM_EVEN
#undef SIM_ODD
#undef SIM_LOW
#undef SIM_HIGH

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

LatticeKernels lattice_kernels() { return {SIM_CHOOSE(split), SIM_CHOOSE(join)}; }

}  // namespace sim
#endif
