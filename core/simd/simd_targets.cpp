#include "core/simd/simd_targets.h"

#include <cstdlib>

namespace sim {

const char* simd_name(SimdLevel level) {
  constexpr const char* kNames[] = {"sse2", "avx2", "avx512"};
  return kNames[static_cast<int>(level)];
}

SimdLevel best_simd_level() {
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512dq"))
    return SimdLevel::kAvx512;
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") ? SimdLevel::kAvx2
                                                                         : SimdLevel::kSse2;
}

SimdLevel simd_level() {
  const SimdLevel best = best_simd_level();
  const char* const wish = std::getenv("SIM_SIMD");
  for (const SimdLevel level : {SimdLevel::kSse2, SimdLevel::kAvx2})
    if (wish && std::string_view(wish) == simd_name(level) && level < best) return level;
  return best;
}

}  // namespace sim
