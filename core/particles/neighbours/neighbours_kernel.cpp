#include "core/particles/neighbours/neighbours.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "core/particles/neighbours/neighbours_kernel.cpp"
#include "core/simd/foreach_target.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

// Calls f(place, id) for all of some rows.
template <class F>
SIM_INLINE void for_each_place(const CellGrid::Rows& rows, const std::int32_t* order, const F& f) {
  for (int row = 0; row < rows.count; ++row)
    for (int p = rows.at[row].begin; p < rows.at[row].end; ++p)
      f(p, static_cast<std::uint32_t>(order[p]));
}

// A bitmap tells how many ids are lower: faster than comparisons, as the particles of a cell share
// the work.
int sort(const CellGrid::Rows& rows, const std::int32_t* order, const double* points,
         const FoundParticles& to) {
  for_each_place(
      rows, order, [&](int, std::uint32_t i) __attribute__((always_inline)) {
        to.ids[i / 64].bits |= std::uint64_t{1} << i % 64;
        to.filled[i / 4096] |= std::uint64_t{1} << i / 64 % 64;
      });
  std::int64_t count = 0;
  for (int first = 0; first < to.words; first += 64)
    for (std::uint64_t& filled = to.filled[first / 64]; filled != 0; filled &= filled - 1) {
      FoundParticles::Word& word = to.ids[first + __builtin_ctzll(filled)];
      word.before = count;
      count += __builtin_popcountll(word.bits);
    }
  for_each_place(
      rows, order, [&](int p, std::uint32_t i) __attribute__((always_inline)) {
        const FoundParticles::Word& word = to.ids[i / 64];
        const std::uint64_t lower = word.bits & ((std::uint64_t{1} << i % 64) - 1);
        const std::int64_t next = word.before + __builtin_popcountll(lower);
        to.places[next] = p;
        for (int axis = 0; axis < 3; ++axis)
          to.q[axis][next] = points[4 * static_cast<std::ptrdiff_t>(p) + axis];
      });
  for_each_place(
      rows,
      order, [&](int, std::uint32_t i) __attribute__((always_inline)) { to.ids[i / 64].bits = 0; });
  return static_cast<int>(count);
}

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

constexpr NeighbourKernels kNeighbours{sort, near};

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

NeighbourKernels neighbour_kernels() { return SIM_CHOOSE(kNeighbours); }

}  // namespace sim
#endif
