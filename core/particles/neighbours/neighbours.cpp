#include "core/particles/neighbours/neighbours.h"

#include <algorithm>
#include <atomic>

#include "core/base/assert.h"
#include "core/base/error.h"
#include "core/base/memory.h"
#include "core/base/text.h"

namespace sim {
namespace {

constexpr std::size_t kMostSlots = std::size_t{1} << 30;

// Lists reach slightly beyond the cutoff, so that rounding of a distance loses no pair.
constexpr double kMargin = 1 + 1e-9;

}  // namespace

Neighbours::Neighbours(double cutoff, double skin) : range_(cutoff + skin), half_skin_(0.5 * skin) {
  SIM_ASSERT(cutoff > 0 && skin >= 0);
}

// Two particles that were more than cutoff + skin apart stay more than the cutoff apart as long as
// neither has moved more than skin / 2.
bool Neighbours::update(const ParticleView& view, ThreadPool& pool) {
  if (builds_ == 0) {
    build(view, pool);
    return true;
  }
  std::atomic<bool> far{false}, changed{false};
  pool.run_parts(view.n, 8, [&](int begin, int end) {
    bool part_far = false, part_changed = false;
    for (int i = begin; i < end; ++i) {
      double* const point = points_.data() + 4 * std::ptrdiff_t{place(i)};
      const double now[3] = {view.x[i], view.y[i], view.z[i]};
      double moved = 0;
      for (int axis = 0; axis < 3; ++axis) {
        const double d = now[axis] - built_[axis].data()[i];
        moved += d * d;
        part_changed |= now[axis] != point[axis];
        point[axis] = now[axis];
      }
      part_far |= !(moved <= half_skin_ * half_skin_);
    }
    if (part_far) far.store(true, std::memory_order_relaxed);
    if (part_changed) changed.store(true, std::memory_order_relaxed);
  });
  if (far) build(view, pool);
  return far || changed;
}

void Neighbours::build(const ParticleView& view, ThreadPool& pool) {
  const auto n = static_cast<std::size_t>(view.n), blocks = (n + 7) / 8;
  SIM_ASSERT(builds_ == 0 || place_.size() == n);
  grid_.sort(view, range_);
  order_ = grid_.order();
  if (builds_++ == 0) {
    place_.resize(n);
    blocks_.resize(blocks);
    points_ = Array(4 * 8 * blocks);
    for (Array& axis : built_) axis = Array(8 * blocks + 8);
  }
  while (shares_.size() < static_cast<std::size_t>(pool.most())) {
    Share& share = shares_.emplace_back();
    share.slots = ArrayOf<std::int32_t>(8);
    share.ids.resize(n / 64 + 1);
    share.filled.resize(n / 4096 + 1);
    share.places.resize(n);
    share.near.resize(n + 8);
    for (Array& axis : share.q) axis = Array(n + 8);
  }
  const double* const q[3] = {view.x, view.y, view.z};
  for (std::size_t p = 0; p < n; ++p) {
    const std::int32_t i = order_[p];
    place_[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(p);
    for (std::size_t axis = 0; axis < 3; ++axis) points_[4 * p + axis] = q[axis][i];
  }
  for (int axis = 0; axis < 3; ++axis) std::copy_n(q[axis], n, built_[axis].data());

  // Lists that exceed their memory are only counted, and rebuilt when there is room.
  for (;;) {
    const int ranks = static_cast<int>(shares_.size());
    pool.run([&](int rank) {
      for (int r = rank; r < ranks; r += pool.size()) {
        const Part part = part_of(static_cast<int>(8 * blocks), 8, r, ranks);
        list(part.begin / 8, part.end / 8, shares_[static_cast<std::size_t>(r)]);
      }
    });
    std::size_t needed = 0;
    bool complete = true;
    for (const Share& share : shares_) {
      needed += share.needed;
      complete = complete && share.needed <= share.slots.size();
    }
    if (complete) return;
    if (needed > kMostSlots) {
      builds_ = 0;
      throw Error(ErrorKind::kScene,
                  {"neighbour lists", "",
                   "the lists of all pairs up to " + shortest(range_) + " m apart would take " +
                       std::to_string(needed >> 28) + " GiB, more than 4",
                   "choose a smaller cutoff or skin, or set the particles further apart"});
    }
    require_memory(9.0 / 8 * sizeof(std::int32_t) * static_cast<double>(needed),
                   "the lists of all pairs up to " + shortest(range_) + " m apart need", "",
                   "choose a smaller cutoff or skin, or fewer particles");
    for (Share& share : shares_)
      if (share.needed > share.slots.size())
        share.slots = ArrayOf<std::int32_t>(share.needed + share.needed / 8);
  }
}

// Builds the lists of blocks [first, last).
void Neighbours::list(int first, int last, Share& share) {
  const int n = static_cast<int>(place_.size());
  const double* const q[3] = {share.q[0].data(), share.q[1].data(), share.q[2].data()};
  const double limit = range_ * range_ * kMargin;
  int cell = -1, own = 0;
  share.needed = 0;
  for (int b = first; b < last; ++b) {
    NeighbourBlock& block = blocks_[static_cast<std::size_t>(b)];
    block = {};
    for (int lane = 0; lane < 8 && 8 * b + lane < n; ++lane) {
      const int place = 8 * b + lane;
      if (grid_.cell_at(place) != cell) {
        cell = grid_.cell_at(place);
        share.count = kernels_.sort(grid_.around(cell), order_.data(), points_.data(),
                                    {share.ids.data(),
                                     share.filled.data(),
                                     static_cast<int>(share.ids.size()),
                                     share.places.data(),
                                     {share.q[0].data(), share.q[1].data(), share.q[2].data()}});
        own = 0;
      }
      // The search continues from the previous one: the ids of a cell ascend.
      while (share.places[static_cast<std::size_t>(own)] != place) {
        ++own;
        SIM_ASSERT(own < share.count);
      }
      std::int32_t* const near = share.near.data();
      int count = kernels_.near(q, 0, own, own, limit, near);
      count += kernels_.near(q, own + 1, share.count, own, limit, near + count);
      SIM_ASSERT(count < share.count);  // it is no neighbour of its own
      block.count[lane] = count;
      block.length = std::max(block.length, count);
      if (share.needed + 8 * static_cast<std::size_t>(block.length) > share.slots.size()) continue;
      std::int32_t* const slots = share.slots.data() + share.needed + lane;
      for (int k = 0; k < count; ++k)
        slots[8 * k] = share.places[static_cast<std::size_t>(near[k])];
    }
    const std::size_t begin = share.needed;
    share.needed += 8 * static_cast<std::size_t>(block.length);
    if (share.needed > share.slots.size()) continue;
    std::int32_t* const slots = share.slots.data() + begin;
    block.slots = slots;
    for (int lane = 0; lane < 8; ++lane)
      for (int k = block.count[lane]; k < block.length; ++k) slots[8 * k + lane] = 8 * b + lane;
  }
}

std::int64_t Neighbours::entries() const {
  std::int64_t sum = 0;
  for (const NeighbourBlock& block : blocks_)
    for (const std::int32_t count : block.count) sum += count;
  return sum;
}

}  // namespace sim
