#include "core/ode/state_shape.h"

#include <algorithm>

#include "core/base/assert.h"

namespace sim {

StateShape::StateShape(std::size_t size, std::vector<StatePart> parts)
    : size_(size), parts_(std::move(parts)) {
  // Components that are contiguous in X share one range; otherwise each has its own.
  for (const StatePart& part : parts_) {
    if (part.count == 0) continue;
    const std::size_t components = part.components.size();
    if (part.item_stride == components) {
      ranges_.push_back({part.begin, part.begin + part.count * components});
    } else {
      for (std::size_t c = 0; c < components; ++c)
        ranges_.push_back({part.at(0, c), part.at(part.count - 1, c) + 1});
    }
  }
  std::ranges::sort(ranges_, {}, &Range::begin);
  // Ranges do not overlap, and lie within X.
  SIM_ASSERT(std::ranges::adjacent_find(ranges_, [](const Range& a, const Range& b) {
               return a.end > b.begin;
             }) == ranges_.end());
  SIM_ASSERT(ranges_.empty() || ranges_.back().end <= size_);
}

StateShape StateShape::flat(std::size_t count) {
  return {
      count,
      {{.name = "component", .item = "component", .components = {"component"}, .count = count}}};
}

StateShape StateShape::points(std::size_t count) {
  return {3 * count,
          {{.name = "position",
            .item = "point",
            .components = {"x", "y", "z"},
            .count = count,
            .item_stride = 3,
            .component_stride = 1}}};
}

const StatePart* StateShape::find(std::string_view name) const& {
  const auto part = std::ranges::find(parts_, name, &StatePart::name);
  return part == parts_.end() ? nullptr : &*part;
}

std::vector<std::size_t> StateShape::places() const {
  std::vector<std::size_t> places;
  for (const Range& range : ranges_)
    for (std::size_t at = range.begin; at < range.end; ++at) places.push_back(at);
  return places;
}

}  // namespace sim
