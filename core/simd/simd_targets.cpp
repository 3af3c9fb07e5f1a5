#include "core/simd/simd_targets.h"

#include <cstdlib>

namespace sim {

const char* simd_name(SimdLevel level) {
  constexpr const char* kNames[] = {"sse2", "fma", "avx2", "avx512", "neon", "wasm"};
  return kNames[static_cast<int>(level)];
}

std::span<const SimdLevel> simd_levels() {
#if defined(__x86_64__)
  static constexpr SimdLevel kLevels[] = {SimdLevel::kSse2, SimdLevel::kFma, SimdLevel::kAvx2,
                                          SimdLevel::kAvx512};
  __builtin_cpu_init();
  std::size_t count = 1;
  if (__builtin_cpu_supports("avx") && __builtin_cpu_supports("fma")) count = 2;
  if (count == 2 && __builtin_cpu_supports("avx2")) count = 3;
  if (count == 3 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512dq"))
    count = 4;
  return std::span(kLevels).first(count);
#elif defined(__wasm__)
  static constexpr SimdLevel kLevels[] = {SimdLevel::kWasm};
  return kLevels;
#else
  static constexpr SimdLevel kLevels[] = {SimdLevel::kNeon};
  return kLevels;
#endif
}

SimdLevel simd_level() {
  const std::span<const SimdLevel> levels = simd_levels();
  const char* const wish = std::getenv("SIM_SIMD");
  for (const SimdLevel level : levels)
    if (wish && std::string_view(wish) == simd_name(level)) return level;
  return levels.back();
}

}  // namespace sim
