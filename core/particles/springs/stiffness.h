// K = -dF/dx of springs at one point, as two numbers a spring.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/array.h"
#include "core/particles/particles.h"
#include "core/particles/springs/spring_stiffness.h"
#include "core/particles/springs/springs.h"
#include "core/particles/springs/stiff_net.h"

namespace sim {

// The stiffness of the springs of a run: 0 where a particle owns none, padded as in a layout.
struct StiffRun : RunColumns {
  double *along, *across;
};

// out = shift p + scale K p; 0 where pinned.
struct StiffProduct {
  const double *q[3], *p[3];
  const double* shift;  // of each particle
  double scale;
  const std::uint8_t* free;  // a bit a particle
  double* out[3];
  bool before = false;  // `out` already holds the other part of K p
};

struct SpringModel {
  bool clamped = false;                   // no spring pushes across its length
  const double* const* before = nullptr;  // positions from which tensions are predicted, if any
};

struct StiffKernels {
  void (*linearise)(const StiffRun& run, const double* const q[3], const SpringModel& model,
                    int begin, int end);
  // sums[i] += the sum of -along > 0 of the springs at i.
  void (*pushes)(std::span<const StiffRun> runs, double* sums, int begin, int end);
  // along < 0 becomes along times the smaller share of both ends.
  void (*soften)(const StiffRun& run, const double* shares, int begin, int end);
  void (*product)(std::span<const StiffRun> runs, const StiffProduct& product, int begin, int end,
                  double (&sums)[8]);
  void (*diagonal)(std::span<const StiffRun> runs, const double* const q[3], const double* shift,
                   double scale, double* const blocks[6], int begin, int end);
};

StiffKernels stiff_kernels();  // for this machine

// For particles [i, i + lanes), one spring at a time, if a distance leaves the fast path.
void linearise_carefully(const StiffRun& run, const double* const q[3], const SpringModel& model,
                         int i, int lanes);

class Stiffness {
 public:
  explicit Stiffness(const Particles& system);

  // Chooses the point; q must stay as it is until the last use.
  void at(const double* const q[3], const SpringModel& model);

  // Reduces the geometric stiffness of compressed springs until the sum of -2 along at a particle
  // is no more than `share` of its shift: with share < 1, shift I + scale K is definite.
  void soften(const double* shift, double scale, const std::uint8_t* free, double share);
  // The remaining fraction of the geometric stiffness at each particle; a layout of one block.
  void find_parts(const double* shift, double scale, const std::uint8_t* free, double share,
                  double* parts) const;

  // Computes out for the particles [begin, end), begin a multiple of 8. sums += the lanes of p.out.
  void apply(StiffProduct product, int begin, int end, double (&sums)[8]) const;

  // blocks[0 .. 5][i] := xx xy xz yy yz zz of shift I + scale sum K over the springs at i.
  void diagonal(const double* shift, double scale, double* const blocks[6], int begin,
                int end) const;
  template <class Visit>  // visit(a, b, stiffness) of every spring, a < b, in one order
  void for_each(Visit visit) const;
  template <class Visit>  // visit(to, stiffness) of every end of a net at particle i
  void net_at(int i, Visit visit) const {
    for (const StiffNet& net : nets_) net.at(i, visit);
  }
  Vec3 position(int i) const { return {q_[0][i], q_[1][i], q_[2][i]}; }  // of the point
  const double* const* positions() const noexcept { return q_; }
  std::span<const StiffRun> runs() const noexcept { return runs_; }

 private:
  const Particles* system_;
  StiffKernels kernels_;
  std::vector<StiffRun> runs_;
  std::vector<StiffNet> nets_;
  Array memory_, shares_;
  const double* q_[3] = {};
};

template <class Visit>
void Stiffness::for_each(Visit visit) const {
  const int n = system_->layout().n();
  for (int a = 0; a < n; ++a) {
    for (const StiffRun& run : runs_)
      if (bit(run.owners, a)) {
        const int b = a + static_cast<int>(run.stride);
        visit(a, b, SpringStiffness{run.along[a], run.across[a]});
      }
    if (!nets_.empty())
      net_at(a, [&](int b, SpringStiffness stiffness) {
        if (a < b) visit(a, b, stiffness);
      });
  }
}

}  // namespace sim
