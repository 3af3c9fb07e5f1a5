#include "core/particles/springs/net.h"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <numeric>
#include <tuple>

#include "core/base/assert.h"

namespace sim {
namespace {

constexpr int kReorderFrom = 1 << 15;  // particles; fewer stay in the second-level cache anyway

struct End {
  int to;
  double k, rest;
};

// The springs at every particle, sorted by their other ends.
class Ends {
 public:
  Ends(int n, std::span<const Net::Spring> springs)
      : first_(static_cast<std::size_t>(n) + 1), ends_(2 * springs.size()) {
    for (const Net::Spring& s : springs) {
      SIM_ASSERT(s.a != s.b && s.a >= 0 && s.a < n && s.b >= 0 && s.b < n);
      ++first_[static_cast<std::size_t>(s.a)];
      ++first_[static_cast<std::size_t>(s.b)];
    }
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    // Filled from behind, so that each `first` ends up at the first end.
    for (const Net::Spring& s : springs) {
      ends_[--first_[static_cast<std::size_t>(s.a)]] = {s.b, s.k, s.rest};
      ends_[--first_[static_cast<std::size_t>(s.b)]] = {s.a, s.k, s.rest};
    }
    for (std::size_t i = 0; i + 1 < first_.size(); ++i)
      std::sort(ends_.data() + first_[i], ends_.data() + first_[i + 1],
                [](const End& l, const End& r) {
                  return std::tie(l.k, l.rest, l.to) < std::tie(r.k, r.rest, r.to);
                });
  }

  std::span<const End> at(int i) const {
    const auto begin = first_[static_cast<std::size_t>(i)];
    return {ends_.data() + begin, first_[static_cast<std::size_t>(i) + 1] - begin};
  }

 private:
  std::vector<std::size_t> first_;
  std::vector<End> ends_;
};

// The Cuthill-McKee order (1969): breadth first from a particle of low degree, neighbours by
// ascending degree; then the next component.
std::vector<std::int32_t> cuthill_mckee(int n, const Ends& ends) {
  const auto fewer_ends = [&](int l, int r) {
    return std::pair(ends.at(l).size(), l) < std::pair(ends.at(r).size(), r);
  };
  std::vector<std::int32_t> starts(static_cast<std::size_t>(n));
  std::iota(starts.begin(), starts.end(), 0);
  std::sort(starts.begin(), starts.end(), fewer_ends);

  std::vector<std::int32_t> order;
  order.reserve(starts.size());
  std::vector<bool> seen(starts.size());
  const auto append = [&](std::int32_t i) {
    if (seen[static_cast<std::size_t>(i)]) return;
    seen[static_cast<std::size_t>(i)] = true;
    order.push_back(i);
  };
  std::size_t next = 0;
  for (const std::int32_t start : starts)
    for (append(start); next < order.size(); ++next) {
      const auto neighbours = static_cast<std::ptrdiff_t>(order.size());
      for (const End& end : ends.at(order[next])) append(end.to);
      std::sort(order.begin() + neighbours, order.end(), fewer_ends);
    }
  SIM_ASSERT(order.size() == starts.size());  // a permutation: each particle is appended once
  return order;
}

std::vector<std::int32_t> inverse(const std::vector<std::int32_t>& order) {
  std::vector<std::int32_t> place(order.size());
  for (std::size_t p = 0; p < order.size(); ++p)
    place[static_cast<std::size_t>(order[p])] = static_cast<std::int32_t>(p);
  return place;
}

// True if the springs are much shorter in the new order than by id.
bool brings_together(std::span<const std::int32_t> place, std::span<const Net::Spring> springs) {
  double by_number = 0, by_place = 0;
  for (const Net::Spring& s : springs) {
    by_number += std::abs(s.a - s.b);
    by_place +=
        std::abs(place[static_cast<std::size_t>(s.a)] - place[static_cast<std::size_t>(s.b)]);
  }
  return 4 * by_place < by_number;
}

}  // namespace

Net::Net(int n, std::span<const Spring> springs, SpringSense of_all, bool own_numbers)
    : sense(of_all) {
  if (springs.empty()) return;
  const Ends ends(n, springs);

  // Reordering costs a pass over all particles, which a few springs do not repay.
  const int blocks = (n + 7) / 8;
  if (n >= kReorderFrom && 2 * springs.size() >= static_cast<std::size_t>(n)) {
    std::vector<std::int32_t> own_order = cuthill_mckee(n, ends), own_place = inverse(own_order);
    if (brings_together(own_place, springs)) {
      own_order.resize(8 * static_cast<std::size_t>(blocks));
      own_place.resize(own_order.size());
      order = std::move(own_order);
      place = std::move(own_place);
    }
  }

  const auto ends_at = [&](int p) -> std::span<const End> {
    if (p >= n) return {};
    return ends.at(reordered() ? order[static_cast<std::size_t>(p)] : p);
  };
  // A block has as many slots as its particle with the most ends.
  first.assign(static_cast<std::size_t>(blocks) + 1, 0);
  for (int block = 0; block < blocks; ++block) {
    std::size_t most = 0;
    for (int lane = 0; lane < 8; ++lane) most = std::max(most, ends_at(8 * block + lane).size());
    first[static_cast<std::size_t>(block) + 1] =
        first[static_cast<std::size_t>(block)] + static_cast<int>(most);
  }
  slots = ArrayOf<Slot>(static_cast<std::size_t>(first.back()));
  const auto last_empty = std::ranges::upper_bound(first, 0) - first.begin() - 1;
  const auto full = std::ranges::lower_bound(first, first.back()) - first.begin();
  used_ = {8 * static_cast<int>(last_empty), 8 * static_cast<int>(full)};

  std::map<std::pair<double, double>, int> kind_numbers;  // by k and rest
  Slot* next = slots.data();
  for (int block = 0; block < blocks; ++block) {
    std::span<const End> block_ends[8];
    for (int lane = 0; lane < 8; ++lane) block_ends[lane] = ends_at(8 * block + lane);
    const Slot* const end_of_block = slots.data() + first[static_cast<std::size_t>(block) + 1];
    for (std::size_t s = 0; next != end_of_block; ++s, ++next) {
      Slot& slot = *next;
      const End* model = nullptr;
      bool alike = sense == SpringSense::kBoth && !own_numbers;
      for (int lane = 0; lane < 8; ++lane) {
        if (s >= block_ends[lane].size()) continue;
        const End& end = block_ends[lane][s];
        if (!model) model = &end;
        alike = alike && end.k == model->k && end.rest == model->rest;
        slot.present |= static_cast<std::uint8_t>(1u << lane);
        slot.to[lane] = end.to;
      }
      SIM_ASSERT(model);  // a block has no more slots than its fullest particle has ends
      if (alike) {
        const auto [found, fresh] =
            kind_numbers.try_emplace({model->k, model->rest}, static_cast<int>(kinds.size()));
        if (fresh) kinds.push_back({model->k, model->rest, model->k * model->rest});
        slot.kind = found->second;
      } else {
        slot.kind = -1 - static_cast<std::int32_t>(ks.size());
        for (const auto& of_lane : block_ends) {
          const bool there = s < of_lane.size();
          ks.push_back(there ? of_lane[s].k : 0);
          rests.push_back(there ? of_lane[s].rest : 0);
        }
      }
    }
  }
  SIM_ASSERT(next == slots.data() + slots.size());
  SIM_ASSERT(ks.size() == rests.size() && ks.size() % 8 == 0);
}

}  // namespace sim
