// The instruction sets that kernels are compiled for (core/simd/foreach_target.h), and the best one
// of the machine.
#pragma once

#include <optional>
#include <span>
#include <string_view>

namespace sim {

// fma is sse2 with a fused multiply-add.
enum class SimdLevel { kSse2, kFma, kAvx2, kAvx512, kNeon, kWasm };

const char* simd_name(SimdLevel level);  // "sse2", "fma", "avx2", "avx512", "neon", "wasm"

// The levels that this machine has, the best one last, whatever the environment says.
std::span<const SimdLevel> simd_levels();

// The best level of this machine, or a lower one named by the environment variable SIM_SIMD.
// All levels give the same bits.
SimdLevel simd_level();

// The processor features of x86-64 that simd_level() asks for.
template <class T>
T for_simd_level(T sse2, T fma, T avx2, T avx512) {
  switch (simd_level()) {
    case SimdLevel::kAvx512:
      return avx512;
    case SimdLevel::kAvx2:
      return avx2;
    case SimdLevel::kFma:
      return fma;
    default:
      return sse2;
  }
}

}  // namespace sim
