#include "core/geometry/incidence.h"

#include <algorithm>

#include "core/base/assert.h"

namespace sim {

Incidence::Incidence(int n, std::span<const int> ids) : places_(ids.size()) {
  SIM_ASSERT(std::ranges::all_of(ids, [n](int id) { return 0 <= id && id < n; }));
  if (ids.empty()) return;
  const auto [lowest, highest] = std::ranges::minmax(ids);
  begin_ = lowest;
  first_.resize(static_cast<std::size_t>(highest - lowest) + 2);
  const auto at = [&](int id) { return static_cast<std::size_t>(id - begin_); };
  for (const int id : ids) ++first_[at(id) + 1];
  for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  SIM_ASSERT(first_.back() == static_cast<int>(ids.size()));
  std::vector<int> next(first_.begin(), first_.end() - 1);
  for (std::size_t corner = 0; corner < ids.size(); ++corner)
    places_[static_cast<std::size_t>(next[at(ids[corner])]++)] = static_cast<int>(corner);
}

}  // namespace sim
