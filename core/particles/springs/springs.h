// Springs in a form for vector units: runs of constant index stride, and the rest as a list.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/math/vec3.h"
#include "core/particles/force.h"
#include "core/particles/springs/net.h"
#include "core/particles/springs/spring_run.h"

namespace sim {

// The force on a from a spring to b is s d with d = x_a - x_b:
//   f = -k (|d| - rest) d / |d| = s d,  s = k rest / |d| - k
// s = 0 for rest > 0 where d = 0 or 1/|d| overflows, exactly -k for rest = 0 and any size of d. The
// same bits as the vector code where |d|^2 is in its range.
double spring_factor(const Vec3& d, double k, double k_rest);
inline Vec3 spring_force(const Vec3& d, double k, double k_rest) {
  return spring_factor(d, k, k_rest) * d;
}

// The same, but 0 if it is slack.
double spring_factor(SpringSense sense, const Vec3& d, double k, double rest);
inline Vec3 spring_force(SpringSense sense, const Vec3& d, double k, double rest) {
  return spring_factor(sense, d, k, rest) * d;
}

// The stretch |d| - rest, or 0 if the spring is slack.
double spring_stretch(SpringSense sense, const Vec3& d, double rest);

// The range in which |d|^2 is far from underflow and overflow.
inline constexpr double kSafeLeast = 1e-280, kSafeMost = 1e280;

// |d| without overflow or underflow.
double length(const Vec3& d);

class Springs {
 public:
  using Visit = std::function<void(int a, int b, double k, double rest)>;

  // Finds the runs in any list of springs: for_each calls its argument for every spring, always in
  // the same order, with a != b in [0, n). breakable: set() may change the numbers of each.
  Springs(int n, const std::function<void(const Visit&)>& for_each,
          SpringSense sense = SpringSense::kBoth, bool breakable = false);

  std::span<const SpringRun> runs() const { return runs_; }
  const Net& net() const { return net_; }  // springs in no run
  int particles() const { return n_; }
  long count() const { return count_; }
  SpringSense sense() const { return sense_; }  // of all

  // Elastic energy of the springs whose lower end is in the tile, in J.
  double potential(const ParticleView& view, Tile tile) const;

  // Sets the numbers of spring `index`, in the order of for_each; of a broken one, 0 and 0.
  void set(std::size_t index, double k, double rest);

  // Calls visit(to, k, rest) for every spring at particle i.
  template <class V>
  void at(int i, V visit) const {
    with_broken_at(i, [&](int to, double k, double rest) {
      if (places_.empty() || k > 0) visit(to, k, rest);
    });
  }

  // Calls visit(a, b, k, rest), a < b, once for every spring.
  template <class V>
  void for_each(V visit) const {
    for (int a = 0; a < n_; ++a)
      at(a, [&](int b, double k, double rest) {
        if (a < b) visit(a, b, k, rest);
      });
  }

  // Visits broken springs, with k = 0, too; otherwise like at().
  template <class V>
  void with_broken_at(int i, V visit) const {
    for (const SpringRun& run : runs_) {
      if (i + run.stride < n_ && run.owns(i)) visit(i + run.stride, run.k_of(i), run.rest_of(i));
      const int a = i - run.stride;
      if (a >= 0 && run.owns(a)) visit(a, run.k_of(a), run.rest_of(a));
    }
    net_.at(i, visit);
  }

 private:
  void find_places(const std::function<void(const Visit&)>& for_each);
  int n_;
  SpringSense sense_;
  long count_ = 0;
  std::vector<SpringRun> runs_;
  Net net_;
  // The locations of the k and rest of each breakable spring: one in a run, or both ends in the
  // net.
  struct Numbers {
    std::array<double*, 2> k{}, rest{};
  };
  std::vector<Numbers> places_;
};

}  // namespace sim
