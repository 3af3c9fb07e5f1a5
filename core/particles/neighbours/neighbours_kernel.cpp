#include "core/particles/neighbours/neighbours.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "core/particles/neighbours/neighbours_kernel.cpp"
#include "core/simd/foreach_target.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

int near(const double* const q[3], int begin, int end, int own, double limit, std::int32_t* found) {
  const double* const axes[3] = {q[0], q[1], q[2]};
  const V3<double> here = {splat<double>(axes[0][own]), splat<double>(axes[1][own]),
                           splat<double>(axes[2][own])};
  constexpr unsigned kAll = (1u << kDoubles) - 1;
  int count = 0, p = begin;
  const auto add = [&](unsigned bits) __attribute__((always_inline)) {
    count += append_within(squared(load(axes, p) - here), limit, bits, p, found + count);
  };
  for (; p + kDoubles <= end; p += kDoubles) add(kAll);
  if (p < end) add(kAll >> (kDoubles - (end - p)));
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
