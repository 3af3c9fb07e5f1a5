#include "core/scene/breaking.h"

#include <algorithm>

namespace sim {
namespace {

std::array<int, 2> ordered(std::array<int, 2> ends) {
  return {std::min(ends[0], ends[1]), std::max(ends[0], ends[1])};
}

}  // namespace

void Breaking::add(Force& force, const std::string& switch_name) {
  forces_.push_back(&force);
  if (Breakable* const ties = force.breakable()) parts_.push_back({ties, 0, switch_name});
}

void Breaking::begin() {
  for (Part& part : parts_) {
    part.first = count_;
    count_ += part.ties->ties();
    for (int tie = 0; tie < part.ties->ties(); ++tie)
      pairs_.push_back(ordered(part.ties->ends(tie)));
  }
  broken_.assign(static_cast<std::size_t>(count_), 0);
  const std::vector<std::array<int, 2>> of_ties = pairs_;
  std::ranges::sort(pairs_);
  pairs_.erase(std::unique(pairs_.begin(), pairs_.end()), pairs_.end());
  for (const auto& pair : of_ties)
    pair_of_.push_back(static_cast<int>(std::ranges::lower_bound(pairs_, pair) - pairs_.begin()));
  std::vector<Link> links;
  for (const auto& [a, b] : pairs_) {
    links.clear();
    for (Force* const force : forces_)
      if (!force->breakable()) force->links(a, links);
    others_.push_back(static_cast<int>(std::ranges::count(links, b, &Link::to)));
  }
}

const Breaking::Part& Breaking::part_of(int tie) const {
  const auto after = std::ranges::upper_bound(parts_, tie, {}, &Part::first);
  return *(after - 1);
}

std::vector<int> Breaking::overloaded(const ParticleView& view,
                                      std::span<const std::string> off) const {
  std::vector<int> found;
  for (const Part& part : parts_) {
    if (std::ranges::binary_search(off, part.switch_name)) continue;
    const std::size_t first = found.size();
    part.ties->find_overloaded(view, found);
    for (std::size_t k = first; k < found.size(); ++k) found[k] += part.first;
  }
  return found;
}

std::vector<int> Breaking::whole_between(int a, int b) const {
  std::vector<int> found;
  const std::array<int, 2> pair = ordered({a, b});
  for (int tie = 0; tie < count_; ++tie)
    if (!broken_[static_cast<std::size_t>(tie)] &&
        pairs_[static_cast<std::size_t>(pair_of_[static_cast<std::size_t>(tie)])] == pair)
      found.push_back(tie);
  return found;
}

double Breaking::energy(const ParticleView& view, std::span<const int> ties) const {
  double sum = 0;
  for (const int tie : ties) {
    const Part& part = part_of(tie);
    sum += part.ties->energy(view, tie - part.first);
  }
  return sum;
}

void Breaking::set_broken(std::span<const int> ties) {
  std::ranges::fill(broken_, std::uint8_t{0});
  for (const int tie : ties) broken_[static_cast<std::size_t>(tie)] = 1;
  std::vector<int> own;
  auto next = ties.begin();
  for (const Part& part : parts_) {
    own.clear();
    for (; next != ties.end() && *next < part.first + part.ties->ties(); ++next)
      own.push_back(*next - part.first);
    part.ties->set_broken(own);
  }
  std::vector<int> left = others_;
  for (std::size_t tie = 0; tie < broken_.size(); ++tie)
    if (!broken_[tie]) ++left[static_cast<std::size_t>(pair_of_[tie])];
  torn_.clear();
  for (std::size_t pair = 0; pair < pairs_.size(); ++pair)
    if (left[pair] == 0) torn_.push_back(pairs_[pair]);
  for (Force* const force : forces_) force->tear(torn_);
}

}  // namespace sim
