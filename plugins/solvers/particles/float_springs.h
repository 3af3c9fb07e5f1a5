// The springs of a matrix in single precision, for the preconditioner.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/array.h"
#include "stage_matrix.h"

namespace sim {

// The springs of a run, by the particle that owns each: the stiffness of one is along I + w w^T.
struct FloatSpringRun {
  const std::uint8_t* owners;
  std::int64_t stride;
  float *along, *w[3];
};

struct FloatSpringProduct {
  std::span<const FloatSpringRun> runs;
  const float *shift, *r[3], *x[3], *inverses[6];
  const std::uint8_t* free;
  float* out[3];
  bool before = false;  // `out` already holds the part of nets
};

struct FloatSpringKernels {
  // Converts a run to units of 1 / scale, with the reduced geometric stiffness of compressed
  // springs.
  void (*narrow)(const StiffRun& from, const double* const q[3], const double* parts, double scale,
                 const FloatSpringRun& to, int begin, int end);
  // blocks[0 .. 5][i] := xx xy xz yy yz zz of shift I + the springs at i.
  void (*diagonal)(std::span<const FloatSpringRun> runs, const float* shift,
                   double* const blocks[6], int begin, int end);
  // out := r - A x, or x + C (r - A x) with the blocks C; 0 where pinned.
  void (*residual)(const FloatSpringProduct& product, int begin, int end);
  void (*relax)(const FloatSpringProduct& product, int begin, int end);
};

FloatSpringKernels float_spring_kernels();  // for this machine

// The matrix A of a stage for a preconditioner: in single precision, divided by its largest entry,
// and always positive definite (Stiffness::soften with a share below 1). Every spring is added at
// both its ends, so that A <= 2 D with the blocks D on its diagonal.
class FloatSprings {
 public:
  explicit FloatSprings(const Particles& system);

  const Layout& layout() const noexcept { return layout_; }
  void take(const StageMatrix& matrix);             // as it is now
  double scale() const noexcept { return scale_; }  // 1 / the largest entry

  // out := C r;  out := r - A x;  out := x + C (r - A x),  C a damped D^-1
  void scale_rest(const float* r, float* out) const;
  void residual(const float* r, const float* x, float* out) const;
  void relax(const float* r, const float* x, float* out) const;

  template <class Visit>  // visit(a, b, along, w) of every spring, a < b, in one order
  void for_each(Visit visit) const;
  double shift(int i) const { return layout_.block(shift_.data(), 0)[i]; }

 private:
  struct End {
    int to;
    float along, w[3];
  };
  FloatSpringProduct product(const float* r, const float* x, float* out) const;
  void add_nets(const FloatSpringProduct& product, int begin, int end) const;

  const Particles* system_;
  FloatSpringKernels kernels_ = float_spring_kernels();
  Layout layout_, doubles_;
  double scale_ = 1;
  ArrayOf<float> memory_, shift_, inverses_;
  Array blocks_, exact_, parts_;
  std::vector<FloatSpringRun> runs_;
  std::vector<int> first_;  // of the ends of each particle in nets
  std::vector<End> ends_;
};

template <class Visit>
void FloatSprings::for_each(Visit visit) const {
  for (int a = 0; a < layout_.n(); ++a) {
    for (const FloatSpringRun& run : runs_)
      if (bit(run.owners, a))
        visit(a, a + static_cast<int>(run.stride), run.along[a],
              Vec3(run.w[0][a], run.w[1][a], run.w[2][a]));
    for (int at = ends_.empty() ? 0 : first_[static_cast<std::size_t>(a)];
         !ends_.empty() && at < first_[static_cast<std::size_t>(a) + 1]; ++at) {
      const End& end = ends_[static_cast<std::size_t>(at)];
      if (a < end.to) visit(a, end.to, end.along, Vec3(end.w[0], end.w[1], end.w[2]));
    }
  }
}

}  // namespace sim
