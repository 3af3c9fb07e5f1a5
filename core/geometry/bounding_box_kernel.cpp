#include "core/geometry/bounding_box.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "core/geometry/bounding_box_kernel.cpp"
#include "core/simd/foreach_target.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

struct Extremes {
  Doubles least[3], most[3], fastest[2], farthest;
};

SIM_INLINE Doubles smaller_of(Doubles a, Doubles b) { return a < b ? a : b; }
SIM_INLINE Doubles larger_of(Doubles a, Doubles b) { return a > b ? a : b; }

SIM_INLINE double least_of(Doubles v) {
  double least = v[0];
  for (int lane = 1; lane < kDoubles; ++lane) least = v[lane] < least ? v[lane] : least;
  return least;
}
SIM_INLINE double most_of(Doubles v) {
  double most = v[0];
  for (int lane = 1; lane < kDoubles; ++lane) most = v[lane] > most ? v[lane] : most;
  return most;
}

SIM_INLINE void look(const double* const q[3], const double* const v0[3], const double* const v1[3],
                     const double* const* from, int i, Extremes& all) {
  const V3<double> x = load(q, i);
  const Doubles xs[3] = {x.x, x.y, x.z};
  for (int axis = 0; axis < 3; ++axis) {
    all.least[axis] = smaller_of(xs[axis], all.least[axis]);
    all.most[axis] = larger_of(xs[axis], all.most[axis]);
  }
  all.fastest[0] = larger_of(squared(load(v0, i)), all.fastest[0]);
  all.fastest[1] = larger_of(squared(load(v1, i)), all.fastest[1]);
  if (from) all.farthest = larger_of(squared(x - load(from, i)), all.farthest);
}

BoundingBox extent(const double* const q[3], const double* const v0[3], const double* const v1[3],
                   const double* const* from, int begin, int end) {
  Extremes all;
  for (int axis = 0; axis < 3; ++axis) {
    all.least[axis] = splat<double>(HUGE_VAL);
    all.most[axis] = splat<double>(-HUGE_VAL);
  }
  all.fastest[0] = all.fastest[1] = all.farthest = Doubles{};
  int i = begin;
  for (; i + kDoubles <= end; i += kDoubles) look(q, v0, v1, from, i, all);
  // The rest overlaps lanes already seen; fewer particles than a vector are taken one by one.
  double rest[12][kDoubles];
  if (i < end && end - kDoubles >= begin) {
    look(q, v0, v1, from, end - kDoubles, all);
  } else if (i < end) {
    const double* parts[4][3];
    for (int axis = 0; axis < 3; ++axis) {
      for (int lane = 0; lane < kDoubles; ++lane) {
        const int at = i + lane < end ? i + lane : i;
        rest[axis][lane] = q[axis][at];
        rest[3 + axis][lane] = v0[axis][at];
        rest[6 + axis][lane] = v1[axis][at];
        rest[9 + axis][lane] = from ? from[axis][at] : 0;
      }
      for (int part = 0; part < 4; ++part) parts[part][axis] = rest[3 * part + axis];
    }
    look(parts[0], parts[1], parts[2], from ? parts[3] : nullptr, 0, all);
  }

  BoundingBox result;
  for (int axis = 0; axis < 3; ++axis) {
    result.least[axis] = least_of(all.least[axis]);
    result.most[axis] = most_of(all.most[axis]);
  }
  result.fastest[0] = most_of(all.fastest[0]);
  result.fastest[1] = most_of(all.fastest[1]);
  result.farthest = most_of(all.farthest);
  return result;
}

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

BoundingBoxOf bounding_box_of() { return SIM_CHOOSE(extent); }

}  // namespace sim
#endif
