#include "core/simd/convert.h"

#include "core/simd/simd_targets.h"

#define SIM_SINGLE 1
#define SIM_KERNEL "core/simd/convert.inc"
#include "core/simd/simd_targets.inc"

namespace sim {

Convert convert() {
  return for_simd_level<Convert>({sse2::single::to_float, sse2::single::to_double},
                                 {avx2::single::to_float, avx2::single::to_double},
                                 {avx512::single::to_float, avx512::single::to_double});
}

}  // namespace sim
