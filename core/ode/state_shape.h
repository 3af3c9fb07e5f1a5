// The layout of a state X as a list of named parts: the meaning of each number, and the padding.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace sim {

// `count` items of some components each: the positions of particles, a flat list of numbers, the
// memory of a force. Strides are in numbers.
struct StatePart {
  std::string name;                     // "position", "velocity", "component", "memory of 'gust'"
  std::string item;                     // of which there are `count`: "particle", "component", ...
  std::vector<std::string> components;  // of one item: {"x", "y", "z"}
  std::size_t count = 0;
  std::size_t begin = 0;  // of component 0 of item 0 in X
  std::size_t item_stride = 1, component_stride = 0;

  std::size_t at(std::size_t item_of, std::size_t component = 0) const {
    return begin + item_of * item_stride + component * component_stride;
  }
};

// The part, item and component that a number of X belongs to.
struct StateNumber {
  const StatePart* part = nullptr;
  std::size_t item = 0, component = 0;
  std::size_t at = 0;  // its place in X

  const std::string& name() const { return part->components[component]; }
};

class StateShape {
 public:
  struct Range {
    std::size_t begin = 0, end = 0;
  };

  StateShape() = default;
  // `size`: numbers of X, padding included.
  StateShape(std::size_t size, std::vector<StatePart> parts);

  static StateShape flat(std::size_t count);    // "component"
  static StateShape points(std::size_t count);  // x0 y0 z0 x1 ...: "position" of "point"

  std::size_t size() const { return size_; }
  // Views of a shape end with it: a temporary shape has none.
  std::span<const StatePart> parts() const& { return parts_; }
  const StatePart* find(std::string_view name) const&;  // null where there is none
  const StatePart& first() const& { return parts_.front(); }
  std::span<const Range> ranges() const& { return ranges_; }  // without padding, ascending
  std::vector<std::size_t> places() const;  // of all numbers, likewise
  std::span<const StatePart> parts() const&& = delete;
  const StatePart* find(std::string_view name) const&& = delete;
  const StatePart& first() const&& = delete;
  std::span<const Range> ranges() const&& = delete;

  // Calls visit(StateNumber) for all numbers until it answers false: item by item, those of parts
  // with the same kind of item together; other kinds follow.
  template <class Visit>
  void each(Visit visit) const {
    for (std::size_t first = 0; first < parts_.size();) {
      std::size_t end = first + 1;
      while (end < parts_.size() && parts_[end].item == parts_[first].item) ++end;
      for (std::size_t i = 0; i < parts_[first].count; ++i)
        for (std::size_t p = first; p < end; ++p)
          for (std::size_t c = 0; c < parts_[p].components.size(); ++c)
            if (!visit(StateNumber{&parts_[p], i, c, parts_[p].at(i, c)})) return;
      first = end;
    }
  }

 private:
  std::size_t size_ = 0;
  std::vector<StatePart> parts_;
  std::vector<Range> ranges_;
};

}  // namespace sim
