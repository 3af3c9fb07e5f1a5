#include "core/simd/convert.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "core/simd/convert_kernel.cpp"
#include "core/simd/foreach_target.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

void to_float(const double* from, float* to, int count) {
  constexpr int lanes = kLanes<float>;
  int i = 0;
  for (; i + lanes <= count; i += lanes) store(to + i, load<float>(from + i));
  for (; i < count; ++i) to[i] = static_cast<float>(from[i]);
}

void to_double(const float* from, double* to, int count) {
  constexpr int lanes = kLanes<float>;
  int i = 0;
  for (; i + lanes <= count; i += lanes) store(to + i, load(from + i));
  for (; i < count; ++i) to[i] = from[i];
}

constexpr Convert kConvert{to_float, to_double};

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

Convert convert() { return SIM_CHOOSE(kConvert); }

}  // namespace sim
#endif
