// The instruction sets that kernels are compiled for (core/simd/foreach_target.h), and the best one
// of the machine.
#pragma once

#include <optional>
#include <string_view>

namespace sim {

enum class SimdLevel { kSse2, kAvx2, kAvx512 };

const char* simd_name(SimdLevel level);  // "sse2", "avx2", "avx512"

// The best level of this machine, or a lower one named by the environment variable SIM_SIMD.
// All levels give the same bits.
SimdLevel simd_level();

// The one of three that simd_level() asks for.
template <class T>
T for_simd_level(T sse2, T avx2, T avx512) {
  switch (simd_level()) {
    case SimdLevel::kAvx512:
      return avx512;
    case SimdLevel::kAvx2:
      return avx2;
    default:
      return sse2;
  }
}

// What the machine itself can do, whatever the environment says.
SimdLevel best_simd_level();

}  // namespace sim
