#include "core/particles/neighbours/neighbours.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "core/particles/neighbours/neighbours_kernel.cpp"
#include "core/simd/foreach_target.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

int near(const double* const q[3], int begin, int end, int own, double limit, std::int32_t* found) {
  const V3<double> here = {splat<double>(q[0][own]), splat<double>(q[1][own]),
                           splat<double>(q[2][own])};
  int count = 0;
  for (int p = begin; p < end; p += kDoubles) {
    const V3<double> d = load(q, p) - here;
    const unsigned bits = end - p < kDoubles ? (1u << (end - p)) - 1 : (1u << kDoubles) - 1;
    count += append_within(squared(d), limit, bits, p, found + count);
  }
  return count;
}

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

NearPoints near_points() { return SIM_CHOOSE(near); }

}  // namespace sim
#endif
