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
  if (Breakable* const ties = force.breakable()) parts_.push_back({ties, 0, switch_name, -1});
}

void Breaking::begin(const Constraints* constraints) {
  constraints_ = constraints;
  const std::vector<Part> of_forces = std::move(parts_);
  parts_.clear();
  for (const Part& part : of_forces) add_ties(part);
  first_rod_ = count_;
  std::vector<std::array<int, 2>> whole_rods;  // that cannot break
  const std::size_t of_constraints = constraints ? constraints->rows().parts.size() : 0;
  for (std::size_t p = 0; p < of_constraints; ++p) {
    const RowList& rows = constraints->rows();
    if (Breakable* const ties = constraints->breakable(p)) {
      add_ties({ties, 0, "", static_cast<int>(p)});
      continue;
    }
    for (int row = rows.parts[p].row; row < rows.end_of(p); ++row)
      if (const std::span<const int> ids = rows.pattern.of(row); ids.size() == 2)
        whole_rods.push_back(ordered({ids[0], ids[1]}));
  }
  broken_.assign(static_cast<std::size_t>(count_), 0);
  const std::vector<std::array<int, 2>> of_ties = pairs_;
  std::ranges::sort(pairs_);
  pairs_.erase(std::unique(pairs_.begin(), pairs_.end()), pairs_.end());
  for (const auto& pair : of_ties)
    pair_of_.push_back(static_cast<int>(std::ranges::lower_bound(pairs_, pair) - pairs_.begin()));
  std::ranges::sort(whole_rods);
  count_others(whole_rods);
}

void Breaking::add_ties(Part part) {
  part.first = count_;
  count_ += part.ties->ties();
  for (int tie = 0; tie < part.ties->ties(); ++tie) pairs_.push_back(ordered(part.ties->ends(tie)));
  parts_.push_back(std::move(part));
}

void Breaking::count_others(std::span<const std::array<int, 2>> whole_rods) {
  std::vector<Link> links;
  for (const auto& [a, b] : pairs_) {
    links.clear();
    for (Force* const force : forces_)
      if (!force->breakable()) force->links(a, links);
    const bool rod = std::ranges::binary_search(whole_rods, std::array<int, 2>{a, b});
    others_.push_back(static_cast<int>(std::ranges::count(links, b, &Link::to)) + rod);
  }
}

const Breaking::Part& Breaking::part_of(int tie) const {
  const auto after = std::ranges::upper_bound(parts_, tie, {}, &Part::first);
  return *(after - 1);
}

std::vector<int> Breaking::overloaded(const ParticleView& view, std::span<const double> multipliers,
                                      std::span<const std::string> off) const {
  std::vector<int> found;
  for (const Part& part : parts_) {
    if (std::ranges::binary_search(off, part.switch_name)) continue;
    std::span<const double> own;
    if (part.constraint >= 0) {
      const RowList& rows = constraints_->rows();
      const auto p = static_cast<std::size_t>(part.constraint);
      const auto row = static_cast<std::size_t>(rows.parts[p].row);
      const auto end = static_cast<std::size_t>(rows.end_of(p));
      if (multipliers.size() < end) continue;  // no forces are known
      own = multipliers.subspan(row, end - row);
    }
    const std::size_t first = found.size();
    part.ties->find_overloaded(view, own, found);
    for (std::size_t k = first; k < found.size(); ++k) found[k] += part.first;
  }
  return found;
}

// Ties that bridge a gap may leave another one where they break.
std::vector<int> Breaking::with_bridges(std::vector<int> broken) const {
  for (;;) {
    std::ranges::sort(broken);
    const std::vector<std::array<int, 2>> torn = torn_by(broken);
    const std::size_t before = broken.size();
    std::vector<int> found;
    for (const Part& part : parts_) {
      found.clear();
      part.ties->find_bridges(torn, found);
      for (const int tie : found)
        if (!std::binary_search(broken.begin(),
                                broken.begin() + static_cast<std::ptrdiff_t>(before),
                                part.first + tie))
          broken.push_back(part.first + tie);
    }
    if (broken.size() == before) return broken;
  }
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

std::vector<std::array<int, 2>> Breaking::torn_by(std::span<const int> broken) const {
  std::vector<int> left = others_;
  std::vector<std::uint8_t> gone(broken_.size(), 0);
  for (const int tie : broken) gone[static_cast<std::size_t>(tie)] = 1;
  for (std::size_t tie = 0; tie < gone.size(); ++tie)
    if (!gone[tie]) ++left[static_cast<std::size_t>(pair_of_[tie])];
  std::vector<std::array<int, 2>> torn;
  for (std::size_t pair = 0; pair < pairs_.size(); ++pair)
    if (left[pair] == 0) torn.push_back(pairs_[pair]);
  return torn;
}

bool Breaking::set_broken(std::span<const int> ties) {
  bool other_equations = false;
  for (int tie = first_rod_; tie < count_; ++tie)
    other_equations = other_equations || (broken_[static_cast<std::size_t>(tie)] != 0) !=
                                             std::ranges::binary_search(ties, tie);
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
  torn_ = torn_by(ties);
  for (Force* const force : forces_) force->tear(torn_);
  return other_equations;
}

}  // namespace sim
