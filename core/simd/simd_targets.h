// Compiles one include file for each instruction set, and picks the best one of the machine.
//
//   #define SIM_KERNEL "core/particles/springs/energy.inc"
//   #include "core/simd/simd_targets.inc"
//
// puts the content of SIM_KERNEL into the namespaces sse2, avx2 and avx512, each compiled for its
// instruction set, on top of the vector type of core/simd/simd.inc. With SIM_SINGLE defined as 1
// the vectors are of floats, and the namespaces sse2::single, avx2::single and avx512::single.
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
