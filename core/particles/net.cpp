#include "core/particles/net.h"

#include <algorithm>
#include <tuple>

namespace sim {
namespace {

struct End {
  int at, to;
  double k, rest;
};

}  // namespace

Net::Net(int n, std::span<const Spring> springs) {
  if (springs.empty()) return;
  std::vector<End> ends;
  ends.reserve(2 * springs.size());
  for (const Spring& s : springs) {
    ends.push_back({s.a, s.b, s.k, s.rest});
    ends.push_back({s.b, s.a, s.k, s.rest});
  }
  std::sort(ends.begin(), ends.end(), [](const End& l, const End& r) {
    return std::tie(l.at, l.k, l.rest, l.to) < std::tie(r.at, r.k, r.rest, r.to);
  });

  // A block has as many slots as its particle with the most ends.
  const int blocks = (n + 7) / 8;
  first.reserve(static_cast<std::size_t>(blocks) + 1);
  auto next = ends.begin();
  for (int block = 0; block < blocks; ++block) {
    const std::size_t begin = slots.size();
    first.push_back(static_cast<int>(begin));
    std::vector<const End*> block_ends[8];
    std::size_t most = 0;
    for (int lane = 0; lane < 8; ++lane) {
      for (; next != ends.end() && next->at == 8 * block + lane; ++next)
        block_ends[lane].push_back(&*next);
      most = std::max(most, block_ends[lane].size());
    }
    for (std::size_t s = 0; s < most; ++s) {
      Slot slot;
      const End* model = nullptr;
      bool alike = true;
      for (int lane = 0; lane < 8; ++lane) {
        if (s >= block_ends[lane].size()) continue;
        const End& end = *block_ends[lane][s];
        if (!model) model = &end;
        alike = alike && end.k == model->k && end.rest == model->rest;
        slot.present |= static_cast<std::uint8_t>(1u << lane);
        slot.to[lane] = end.to;
      }
      slot.k = model->k;
      slot.rest = model->rest;
      slot.k_rest = slot.k * slot.rest;
      if (!alike) {
        slot.own = static_cast<std::int32_t>(ks.size());
        for (const auto& of_lane : block_ends) {
          const bool there = s < of_lane.size();
          ks.push_back(there ? of_lane[s]->k : 0);
          rests.push_back(there ? of_lane[s]->rest : 0);
        }
      }
      slots.push_back(slot);
    }
  }
  first.push_back(static_cast<int>(slots.size()));
  slots.shrink_to_fit();
}

}  // namespace sim
