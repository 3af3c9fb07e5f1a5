#include "core/particles/elements/incidence.h"

namespace sim {

Incidence::Incidence(int n, std::span<const int> ids)
    : first_(static_cast<std::size_t>(n) + 1), places_(ids.size()) {
  for (const int id : ids) ++first_[static_cast<std::size_t>(id) + 1];
  for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  std::vector<int> next(first_.begin(), first_.end() - 1);
  for (std::size_t corner = 0; corner < ids.size(); ++corner)
    places_[static_cast<std::size_t>(next[static_cast<std::size_t>(ids[corner])]++)] =
        static_cast<int>(corner);
}

}  // namespace sim
