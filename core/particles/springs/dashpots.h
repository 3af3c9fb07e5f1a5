// Damping along springs: dashpots between the same pairs of particles.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/base/array.h"
#include "core/particles/force.h"
#include "core/particles/springs/springs.h"

namespace sim {

// The force on a of a dashpot of c N s/m to b, with d = x_a - x_b and w = v_a - v_b:
//   f = -c (w.d^) d^ = -c rho d,  d^ = d / |d|,  rho = (w.d) / |d|^2;  0 where d = 0
// It acts along d, which conserves momentum and angular momentum, and takes the power c (w.d^)^2.
Vec3 dashpot_force(const Vec3& d, const Vec3& w, double c);

// The dashpots of a run: c of the one that particle a owns at [a], 0 where there is none, padded.
struct DashpotRun {
  const double* c;
  std::int64_t stride;
  SpringSense sense = SpringSense::kBoth;  // of one sense: 0 where slack
  const double* rest = nullptr;            // likewise, m; not read otherwise
};

// Adds the forces of all runs on particles [begin, end).
using DashpotForces = void (*)(std::span<const DashpotRun> runs, const ParticleView& view,
                               int begin, int end, ForceSink sink);
DashpotForces dashpot_forces();  // for this machine

// Adds these to `sum` for the particles at `lanes` places from i, one dashpot at a time, if some
// |d|^2 leaves the range of numbers. The same bits for the others.
void add_dashpots_carefully(std::span<const DashpotRun> runs, const ParticleView& view, int i,
                            int lanes, double (*sum)[8]);

// Each dashpot is evaluated from both its ends, so that particles stay independent of each other.
class Dashpots {
 public:
  // See Springs: for_each visits a, b, the damping in N s/m, and the rest length in m, at which
  // dashpots of one sense begin to act; 0 for others. breakable: set() may change them.
  Dashpots(int n, const std::function<void(const Springs::Visit&)>& for_each,
           SpringSense sense = SpringSense::kBoth, bool breakable = false);

  // See Springs::set().
  void set(std::size_t index, double c, double rest) { pairs_.set(index, c, rest); }

  void accumulate(const ParticleView& view, Tile tile, ForceSink sink) const;

  // With p = x or v:  df_a / dp_a = -B,  df_a / dp_b = B,
  //   B_x = c (rho I + d (w - 2 rho d)^T / |d|^2),  B_v = c d d^T / |d|^2
  void jacobian(const ParticleView& view, JacobianSink& sink) const;
  void couplings(std::vector<std::array<int, 2>>& pairs) const;  // as those of a force

 private:
  bool acts(const Vec3& d, double rest) const {
    return pairs_.sense() == SpringSense::kBoth || !slack(pairs_.sense(), length(d), rest);
  }

  Springs pairs_;         // a damping in place of each stiffness
  std::vector<Array> c_;  // of uniform runs
  std::vector<DashpotRun> runs_;
  DashpotForces forces_ = dashpot_forces();
};

}  // namespace sim
