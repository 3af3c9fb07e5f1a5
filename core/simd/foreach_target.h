// Compiles a file of kernels once for each instruction set. The file names itself, and puts what is
// to be compiled several times between the macros, in a namespace of the set:
//
//   #undef SIM_THIS_FILE
//   #define SIM_THIS_FILE "core/x/sum_kernel.cpp"
//   #include "core/simd/foreach_target.h"
//
//   SIM_TARGET_BEGIN
//   namespace sim::SIM_TARGET {
//   void sum(...) { ... }  // on the vectors of core/simd/vector.h
//   }  // namespace sim::SIM_TARGET
//   SIM_TARGET_END
//
//   #if SIM_ONCE
//   ... SIM_CHOOSE(sum) ...  // the one of the set that simd_level() says
//   #endif
//
// On x86-64 the compiler reads the file with SIM_TARGET fma128, avx2 and avx512 while it is here,
// and the rest of it with sse2, which every machine has; on ARM with neon alone, on WebAssembly
// with wasm. Other headers of the file go above these lines, since what they define must not use
// the instructions of a set. The file's name ends in _kernel.cpp: such files stay units of their
// own in a build that joins others.
#ifndef SIM_TARGET

#if defined(__x86_64__)
#include <immintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#elif defined(__wasm_simd128__)
#include "core/simd/wasm_fma.h"
#else
#error "core/simd/ has layers for x86-64, ARM (aarch64) and WebAssembly: this processor needs one"
#endif

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "core/simd/simd_targets.h"

// Vectors pass between inlined functions only, so the calling convention does not matter.
#pragma GCC diagnostic ignored "-Wpsabi"

#define SIM_INLINE inline __attribute__((always_inline))
#if defined(__x86_64__)

#define SIM_PRAGMA(x) _Pragma(#x)
#if defined(__clang__)
#define SIM_BEGIN(t) \
  SIM_PRAGMA(clang attribute push(__attribute__((target(t))), apply_to = function))
#define SIM_END _Pragma("clang attribute pop")
#else
#define SIM_BEGIN(t) _Pragma("GCC push_options") SIM_PRAGMA(GCC target(t))
#define SIM_END _Pragma("GCC pop_options")
#endif
#define SIM_CHOOSE(...) \
  for_simd_level(sse2::__VA_ARGS__, fma128::__VA_ARGS__, avx2::__VA_ARGS__, avx512::__VA_ARGS__)
#define SIM_ONCE 0
#define SIM_FMA 1  // the set has a fused multiply-add

#define SIM_TARGET fma128
#define SIM_BITS 128
#define SIM_TARGET_BEGIN SIM_BEGIN("avx,fma")
#define SIM_TARGET_END SIM_END
#include SIM_THIS_FILE
#undef SIM_TARGET
#undef SIM_BITS
#undef SIM_TARGET_BEGIN

#define SIM_TARGET avx2
#define SIM_BITS 256
#define SIM_TARGET_BEGIN SIM_BEGIN("avx2,fma")
#include SIM_THIS_FILE
#undef SIM_TARGET
#undef SIM_BITS
#undef SIM_TARGET_BEGIN

#define SIM_TARGET avx512
#define SIM_BITS 512
#define SIM_TARGET_BEGIN SIM_BEGIN("avx512f,avx512vl,avx512dq,fma")
#include SIM_THIS_FILE
#undef SIM_TARGET
#undef SIM_BITS
#undef SIM_TARGET_BEGIN
#undef SIM_TARGET_END
#undef SIM_ONCE
#undef SIM_FMA

#define SIM_TARGET sse2
#define SIM_FMA 0

#elif defined(__wasm_simd128__)

#define SIM_CHOOSE(...) wasm::__VA_ARGS__
#define SIM_TARGET wasm
#define SIM_FMA 1

#else

#define SIM_CHOOSE(...) neon::__VA_ARGS__
#define SIM_TARGET neon
#define SIM_FMA 1

#endif

#define SIM_BITS 128
#define SIM_TARGET_BEGIN
#define SIM_TARGET_END
#define SIM_ONCE 1

#endif

#include "core/simd/vector.h"
