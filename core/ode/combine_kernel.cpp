#include "core/ode/ode_system.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "core/ode/combine_kernel.cpp"
#include "core/simd/foreach_target.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

// out := x + sum c k over the terms of a stage.
void combine(const Stage& stage, double* out, std::size_t begin, std::size_t end) {
  constexpr std::size_t lanes = kDoubles;
  constexpr std::size_t kVectors = 4;  // whose sums stay in registers while the terms go by
  const double* const x = stage.x;
  std::size_t i = begin;
  for (; i + kVectors * lanes <= end; i += kVectors * lanes) {
    Doubles sum[kVectors];
#pragma GCC unroll 4
    for (std::size_t v = 0; v < kVectors; ++v) sum[v] = load(x + i + v * lanes);
    for (const auto& [c, k] : stage.terms) {
#pragma GCC unroll 4
      for (std::size_t v = 0; v < kVectors; ++v) sum[v] += c * load(k + i + v * lanes);
    }
#pragma GCC unroll 4
    for (std::size_t v = 0; v < kVectors; ++v) store(out + i + v * lanes, sum[v]);
  }
  for (; i < end; ++i) {
    double sum = x[i];
    for (const auto& [c, k] : stage.terms) sum += c * k[i];
    out[i] = sum;
  }
}

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

CombineRange combine_range() { return SIM_CHOOSE(combine); }

}  // namespace sim
#endif
