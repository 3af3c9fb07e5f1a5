// Springs in the form the machine likes: runs of constant index stride, and the rest as a list.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/base/array.h"
#include "core/base/bits.h"
#include "core/math/vec3.h"
#include "core/particles/force.h"
#include "core/particles/springs/net.h"

namespace sim {

// The force on a from a spring to b is s d with d = x_a - x_b:
//   f = -k (|d| - rest) d / |d| = s d,  s = k rest / |d| - k
// s = 0 for rest > 0 where d = 0 or 1/|d| overflows, exactly -k for rest = 0 and any size of d. The
// same bits as the vector code where |d|^2 is in its range.
double spring_factor(const Vec3& d, double k, double k_rest);
inline Vec3 spring_force(const Vec3& d, double k, double k_rest) {
  return spring_factor(d, k, k_rest) * d;
}

// Where |d|^2 is far from underflow and overflow.
inline constexpr double kSafeLeast = 1e-280, kSafeMost = 1e280;

// |d| without overflow or underflow.
double length(const Vec3& d);

// Springs between a and a + stride for every particle a whose bit is set in `owners`.
struct SpringRun {
  static constexpr int kPad = 16;  // a vector of entries may begin before particle 0

  int stride = 0;
  int count = 0;
  bool uniform = true;
  double k = 0, rest = 0;            // N/m and m, of all springs of a uniform run
  Array ks, rests;                   // otherwise: entry a + kPad for the spring that a owns
  std::vector<std::uint8_t> owners;  // bit a % 8 of byte a / 8; n / 8 + 2 bytes

  bool owns(int a) const { return bit(owners.data(), a); }
  double k_of(int a) const { return uniform ? k : ks[static_cast<std::size_t>(a + kPad)]; }
  double rest_of(int a) const { return uniform ? rest : rests[static_cast<std::size_t>(a + kPad)]; }
};

// A run as kernels read it: arrays indexed by the particle that owns the spring.
struct RunColumns {
  const std::uint8_t* owners;
  const double *ks, *rests;         // null in a uniform run
  double k, rest, k_rest, minus_k;  // of a uniform run
  std::int64_t stride;

  explicit RunColumns(const SpringRun& run)
      : owners(run.owners.data()),
        ks(run.uniform ? nullptr : run.ks.data() + SpringRun::kPad),
        rests(run.uniform ? nullptr : run.rests.data() + SpringRun::kPad),
        k(run.k),
        rest(run.rest),
        k_rest(run.k * run.rest),
        minus_k(-run.k),
        stride(run.stride) {}

  double k_of(std::int64_t a) const { return ks ? ks[a] : k; }
  double rest_of(std::int64_t a) const { return ks ? rests[a] : rest; }
};

class Springs {
 public:
  using Visit = std::function<void(int a, int b, double k, double rest)>;

  // Finds the runs in any list of springs: for_each calls its argument for every spring, always in
  // the same order, with a != b in [0, n). Nothing of the list itself is kept.
  Springs(int n, const std::function<void(const Visit&)>& for_each);

  std::span<const SpringRun> runs() const { return runs_; }
  const Net& net() const { return net_; }  // those in no run

  long count() const { return count_; }

  // Elastic energy of the springs whose lower end is in the tile, in J.
  double potential(const ParticleView& view, Tile tile) const;

  // Calls visit(to, k, rest) for every spring at particle i.
  template <class V>
  void at(int i, V visit) const {
    for (const SpringRun& run : runs_) {
      if (i + run.stride < n_ && run.owns(i)) visit(i + run.stride, run.k_of(i), run.rest_of(i));
      const int a = i - run.stride;
      if (a >= 0 && run.owns(a)) visit(a, run.k_of(a), run.rest_of(a));
    }
    net_.at(i, visit);
  }

 private:
  int n_;
  long count_ = 0;
  std::vector<SpringRun> runs_;
  Net net_;
};

}  // namespace sim
