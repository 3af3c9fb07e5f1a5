#include "core/base/simd_targets.h"
#include "core/ode/ode_system.h"

#define SIM_KERNEL "core/ode/combine.inc"
#include "core/base/simd_targets.inc"

namespace sim {

CombineRange combine_range() {
  switch (simd_level()) {
    case SimdLevel::kAvx512:
      return avx512::combine;
    case SimdLevel::kAvx2:
      return avx2::combine;
    default:
      return sse2::combine;
  }
}

}  // namespace sim
