#include "core/ode/ode_system.h"
#include "core/simd/simd_targets.h"

#define SIM_KERNEL "core/ode/combine.inc"
#include "core/simd/simd_targets.inc"

namespace sim {

CombineRange combine_range() {
  return for_simd_level(sse2::combine, avx2::combine, avx512::combine);
}

}  // namespace sim
