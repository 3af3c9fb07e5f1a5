#include "tests/bench/machine.h"

#if defined(__x86_64__)
#include <immintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <thread>

#include "core/simd/simd_targets.h"
#include "tests/bench/timing.h"

namespace sim_bench {
namespace {

struct Loops {
  int lanes;
  void (*flops)(long rounds);         // 12 vector operations a round
  void (*roots)(long rounds);         // 4 vectors of square roots and divisions a round
  void (*single_roots)(long rounds);  // the same; never fewer than 4 lanes
  void (*triad)(double* a, const double* b, const double* c, std::size_t n);
};

#if defined(__x86_64__)
#define VECTOR "+x"  // a register of them, for the assembler
// A masked square root with a full mask where g++ 12 warns of an undefined value inside the plain
// one.
namespace avx512 {
#define TARGET __attribute__((target("avx512f,avx512vl,avx512dq")))
#define LANES 8
#define ROOT(v) _mm512_maskz_sqrt_pd(0xff, (__m512d)(v))
#define ROOTF(v) _mm256_sqrt_ps((__m256)(v))
#include "tests/bench/machine_loops.inc"
#undef TARGET
#undef LANES
#undef ROOT
#undef ROOTF
}  // namespace avx512

namespace avx2 {
#define TARGET __attribute__((target("avx2")))
#define LANES 4
#define ROOT(v) _mm256_sqrt_pd((__m256d)(v))
#define ROOTF(v) _mm_sqrt_ps((__m128)(v))
#include "tests/bench/machine_loops.inc"
#undef TARGET
#undef LANES
#undef ROOT
#undef ROOTF
}  // namespace avx2

namespace sse2 {
#define TARGET
#define LANES 2
#define ROOT(v) _mm_sqrt_pd((__m128d)(v))
#define ROOTF(v) _mm_sqrt_ps((__m128)(v))
#include "tests/bench/machine_loops.inc"
#undef TARGET
#undef LANES
#undef ROOT
#undef ROOTF
}  // namespace sse2
#else
#define VECTOR "+w"
namespace neon {
#define TARGET
#define LANES 2
#define ROOT(v) vsqrtq_f64((float64x2_t)(v))
#define ROOTF(v) vsqrtq_f32((float32x4_t)(v))
#include "tests/bench/machine_loops.inc"
}  // namespace neon
#endif

Loops widest_loops() {
#if defined(__x86_64__)
  switch (sim::simd_level()) {
    case sim::SimdLevel::kAvx512:
      return avx512::loops();
    case sim::SimdLevel::kAvx2:
      return avx2::loops();
    default:
      return sse2::loops();
  }
#else
  return neon::loops();
#endif
}

// Nanoseconds of one round: the best of many samples that are short beside a slice of the
// scheduler.
template <class Run>
double ns_per_round(Run run) {
  long rounds = 1;
  double best = 0;
  for (int sample = 0; sample < 25;) {
    const double start = seconds_now();
    run(rounds);
    const double taken = seconds_now() - start;
    if (taken < 2e-3) {
      rounds *= 2;
      continue;
    }
    const double ns = taken * 1e9 / static_cast<double>(rounds);
    best = sample++ == 0 ? ns : std::min(best, ns);
  }
  return best;
}

double measure_ghz() {
  const double ns = ns_per_round([](long rounds) {
    long value = 3;
#if defined(__x86_64__)
    for (long r = 0; r < rounds; ++r)
      asm volatile("imul %0, %0\n\timul %0, %0\n\timul %0, %0\n\timul %0, %0" : "+r"(value));
#else
    for (long r = 0; r < rounds; ++r)
      asm volatile("mul %0, %0, %0\n\tmul %0, %0, %0\n\tmul %0, %0, %0\n\tmul %0, %0, %0"
                   : "+r"(value));
#endif
  });
  return 4 * 3 / ns;
}

Bandwidth measure_triad(const Loops& loops, const char* level, double bytes) {
  // Starts that differ by a few lines modulo 4 KiB, or loads wait for stores that only look alike.
  constexpr std::size_t kStagger = 24;
  const std::size_t n = static_cast<std::size_t>(bytes / 24) / 64 * 64;
  const std::size_t whole = (3 * n + 3 * kStagger) * sizeof(double) / 64 * 64 + 64;
  const std::unique_ptr<double, void (*)(void*)> memory(
      static_cast<double*>(std::aligned_alloc(64, whole)), std::free);
  std::fill_n(memory.get(), whole / sizeof(double), 1.0);
  double* const a = memory.get();
  const double* const b = a + n + kStagger;
  const double* const c = b + n + kStagger;
  const double ns = ns_per_round([&](long rounds) {
    for (long r = 0; r < rounds; ++r) loops.triad(a, b, c, n);
  });
  return {level, 24.0 * static_cast<double>(n) / 1024, 24.0 * static_cast<double>(n) / ns};
}

double cache_bytes(int name, double otherwise) {
  const long bytes = sysconf(name);
  return bytes > 0 ? static_cast<double>(bytes) : otherwise;
}

std::string processor_name() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);)
    if (line.starts_with("model name")) {
      const auto colon = line.find(": ");
      if (colon != std::string::npos) return line.substr(colon + 2);
    }
  return "unknown processor";
}

}  // namespace

// A spring takes 35 operations: 3 differences, 5 for |d|^2, 10 for the inverse square root, 2 to
// watch its range, 3 for the factor and its mask, 3 for the force, 6 to add it at both ends; and a
// sixth of the 18 that the stage of a Runge-Kutta method takes a particle.
double Machine::spring_limit_ns() const { return std::max(35 / flops_per_ns, single_root_ns); }

Machine measure_machine() {
  const Loops loops = widest_loops();
  Machine m;
  m.processor = processor_name();
  double load[1] = {};
  m.load = getloadavg(load, 1) == 1 ? load[0] : 0;
  m.cores = static_cast<int>(std::thread::hardware_concurrency());
  m.vector = sim::simd_name(sim::simd_level());
  m.lanes = loops.lanes;
  m.ghz = measure_ghz();
  m.flops_per_ns = 12 * loops.lanes / ns_per_round(loops.flops);
  m.double_root_ns = ns_per_round(loops.roots) / (4 * loops.lanes);
  m.single_root_ns = ns_per_round(loops.single_roots) / (4 * std::max(4, loops.lanes));

  const double l1 = cache_bytes(_SC_LEVEL1_DCACHE_SIZE, 32 << 10);
  const double l2 = cache_bytes(_SC_LEVEL2_CACHE_SIZE, 1 << 20);
  const double l3 = cache_bytes(_SC_LEVEL3_CACHE_SIZE, 8 << 20);
  m.triad = {measure_triad(loops, "L1", l1 / 2), measure_triad(loops, "L2", l2 / 2),
             measure_triad(loops, "L3", std::max(2 * l2, std::min(l3 / 2, 16.0 * (1 << 20)))),
             measure_triad(loops, "memory", std::min(3 * l3, 1.0 * (1 << 30)))};
  return m;
}

}  // namespace sim_bench
