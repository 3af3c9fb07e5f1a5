#include "aggregate_matrix.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "aggregate_kernel.cpp"
#include "core/simd/foreach_target.h"

#include "core/simd/narrow.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

constexpr int kRow = AggregateKernels::kRow, kBlock = AggregateKernels::kBlock;

using Row = Registers<kRow>;

// sum += block x
SIM_INLINE void add_block(const float* block, const double* x, Row& sum) {
  for (int column = 0; column < 6; ++column) {
    const Doubles factor = splat<double>(x[column]);
    for (int k = 0; k < Row::kParts; ++k)
      sum.part[k] = fma(load_narrow(block + column * kRow + k * kDoubles), factor, sum.part[k]);
  }
}

void residual(const WeightedGraph& pattern, const float* blocks, const double* r, const double* x,
              double* out, int begin, int end) {
  for (int i = begin; i < end; ++i) {
    Row sum{}, other{};  // two, so that one sum need not wait for itself
    int at = pattern.begin[static_cast<std::size_t>(i)];
    const int last = pattern.begin[static_cast<std::size_t>(i) + 1];
    for (; at + 1 < last; at += 2) {
      add_block(blocks + static_cast<std::ptrdiff_t>(at) * kBlock,
                x + pattern.to[static_cast<std::size_t>(at)] * kRow, sum);
      add_block(blocks + static_cast<std::ptrdiff_t>(at + 1) * kBlock,
                x + pattern.to[static_cast<std::size_t>(at) + 1] * kRow, other);
    }
    if (at < last)
      add_block(blocks + static_cast<std::ptrdiff_t>(at) * kBlock,
                x + pattern.to[static_cast<std::size_t>(at)] * kRow, sum);
    const Row right = load_registers<kRow>(r + i * kRow);
    Row rest;
    for (int k = 0; k < Row::kParts; ++k)
      rest.part[k] = right.part[k] - (sum.part[k] + other.part[k]);
    store(out + i * kRow, rest);
  }
}

void relax(const float* blocks, double factor, const double* r, double* x, bool add, int begin,
           int end) {
  const Doubles scale = splat<double>(factor);
  for (int i = begin; i < end; ++i) {
    Row sum{};
    add_block(blocks + static_cast<std::ptrdiff_t>(i) * kBlock, r + i * kRow, sum);
    Row to{};
    if (add) to = load_registers<kRow>(x + i * kRow);
    for (int k = 0; k < Row::kParts; ++k) to.part[k] = fma(scale, sum.part[k], to.part[k]);
    store(x + i * kRow, to);
  }
}

constexpr AggregateKernels kRigid{residual, relax};

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

AggregateKernels aggregate_kernels() { return SIM_CHOOSE(kRigid); }

}  // namespace sim
#endif
