#include "core/base/simd_targets.h"
#include "core/ode/ode_system.h"

#define SIM_KERNEL "core/ode/combine.inc"
#include "core/base/simd_targets.inc"

namespace sim {

CombineRange combine_range() {
  return for_simd_level(sse2::combine, avx2::combine, avx512::combine);
}

}  // namespace sim
