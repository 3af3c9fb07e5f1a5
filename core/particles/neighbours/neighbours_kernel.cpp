#include "core/particles/neighbours/neighbours.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "core/particles/neighbours/neighbours_kernel.cpp"
#include "core/simd/foreach_target.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

int near_places(const double* const q[3], int begin, int end, int place, double limit,
                std::int32_t* found) {
  const V3<double> here = {splat<double>(q[0][place]), splat<double>(q[1][place]),
                           splat<double>(q[2][place])};
  int count = 0;
  for (int p = begin; p < end; p += kDoubles) {
    const V3<double> d = load(q, p) - here;
    const unsigned bits = end - p < kDoubles ? (1u << (end - p)) - 1 : (1u << kDoubles) - 1;
    count += append_within(squared(d), limit, bits, p, found + count);
  }
  return count;
}

typedef std::int32_t Ids __attribute__((vector_size(SIM_BITS / 8)));
typedef std::int32_t UnalignedIds
    __attribute__((vector_size(SIM_BITS / 8), aligned(sizeof(std::int32_t)), may_alias));

// The number of smaller ids is the rank: for short lists the quickest sort, as it has no branches.
void spread_by_rank(const std::int32_t* ids, const std::int32_t* places, int count,
                    std::int32_t* slots) {
  constexpr int kIds = 2 * kDoubles;
  for (int k = 0; k < count; k += kIds) {
    const Ids own = *reinterpret_cast<const UnalignedIds*>(ids + k);
    Ids ranks{};
    for (int other = 0; other < count; ++other) ranks -= own > ids[other] - Ids{};
    for (int lane = 0; lane < kIds && k + lane < count; ++lane)
      slots[8 * ranks[lane]] = places[k + lane];
  }
}

constexpr ListKernels kLists{near_places, spread_by_rank};

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

ListKernels list_kernels() { return SIM_CHOOSE(kLists); }

}  // namespace sim
#endif
