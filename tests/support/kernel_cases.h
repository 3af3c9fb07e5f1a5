// Every vector kernel is compared with a plain loop: for 1 to 40 items, with each of them in turn
// the extreme one, at each instruction set of this machine.
#pragma once

#include <catch2/catch.hpp>

#include <cmath>
#include <cstdlib>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/simd/simd_targets.h"

namespace sim_test {

inline constexpr int kMostItems = 40;

// The instruction set that kernels are chosen for while this lives.
class ForcedLevel {
 public:
  explicit ForcedLevel(sim::SimdLevel level) {
    if (const char* const before = std::getenv("SIM_SIMD")) before_ = before;
    setenv("SIM_SIMD", sim::simd_name(level), 1);
  }
  ForcedLevel(const ForcedLevel&) = delete;
  ForcedLevel& operator=(const ForcedLevel&) = delete;
  ~ForcedLevel() { before_ ? setenv("SIM_SIMD", before_->c_str(), 1) : unsetenv("SIM_SIMD"); }

 private:
  std::optional<std::string> before_;
};

// Calls check(items, extreme) for every number of items and every index of the extreme one, at each
// instruction set.
template <class Check>
void for_each_lane(const Check& check) {
  for (const sim::SimdLevel level : sim::simd_levels()) {
    const ForcedLevel forced(level);
    for (int items = 1; items <= kMostItems; ++items)
      for (int extreme = 0; extreme < items; ++extreme) {
        INFO(sim::simd_name(level) << ", " << items << " items, the extreme one is " << extreme);
        check(items, extreme);
      }
  }
}

// Numbers of some items, with room on both sides that kernels may read: finite values that spoil
// each result that they enter.
template <class Number>
class ColumnOf {
 public:
  static constexpr int kRoom = 64;

  explicit ColumnOf(int items = 0, Number filling = Number{7777})
      : items_(items), numbers_(static_cast<std::size_t>(items + 2 * kRoom), filling) {
    for (int i = 0; i < items; ++i) (*this)[i] = Number{};
  }

  int items() const { return items_; }
  Number* data() { return numbers_.data() + kRoom; }
  const Number* data() const { return numbers_.data() + kRoom; }
  Number& operator[](int i) { return numbers_[static_cast<std::size_t>(i + kRoom)]; }
  const Number& operator[](int i) const { return numbers_[static_cast<std::size_t>(i + kRoom)]; }
  std::span<const Number> span() const { return {data(), static_cast<std::size_t>(items_)}; }

 private:
  int items_;
  std::vector<Number> numbers_;
};

using Column = ColumnOf<double>;

// The three coordinates of some items.
template <class Number>
struct AxesOf {
  ColumnOf<Number> axis[3];

  explicit AxesOf(int items)
      : axis{ColumnOf<Number>(items), ColumnOf<Number>(items), ColumnOf<Number>(items)} {}
  ColumnOf<Number>& operator[](int k) { return axis[k]; }
  const ColumnOf<Number>& operator[](int k) const { return axis[k]; }
};

using Axes = AxesOf<double>;

template <class Number>
struct PointersOf {
  Number* axis[3];
  operator Number* const*() const { return axis; }
};
template <class Number>
PointersOf<const Number> inputs(const AxesOf<Number>& from) {
  return {{from[0].data(), from[1].data(), from[2].data()}};
}
template <class Number>
PointersOf<Number> outputs(AxesOf<Number>& to) {
  return {{to[0].data(), to[1].data(), to[2].data()}};
}

// Numbers between -1 and 1 without a pattern, the same ones for the same item and field.
inline double scattered(int item, int field) {
  const auto seed =
      static_cast<unsigned>(item) * 2654435761u + static_cast<unsigned>(field) * 40503u;
  const unsigned mixed = (seed ^ seed >> 15) * 2246822519u;
  return static_cast<double>((mixed ^ mixed >> 13) % 200003u) / 100001.0 - 1;
}
template <class Number>
void scatter(ColumnOf<Number>& column, int field) {
  for (int i = 0; i < column.items(); ++i) column[i] = static_cast<Number>(scattered(i, field));
}
template <class Number>
void scatter(AxesOf<Number>& axes, int field) {
  for (int k = 0; k < 3; ++k) scatter(axes[k], 3 * field + k);
}

// A bit an item, of those that `has` says.
template <class Has>
std::vector<std::uint8_t> bits_where(int items, const Has& has) {
  std::vector<std::uint8_t> bits(static_cast<std::size_t>(items / 8 + 16));
  for (int i = 0; i < items; ++i)
    if (has(i)) bits[static_cast<std::size_t>(i / 8)] |= static_cast<std::uint8_t>(1 << i % 8);
  return bits;
}

// The same number, where one that is not a number equals another; or within a share of `scale`.
template <class Number>
bool agree(Number a, Number b, double tolerance = 0) {
  if (std::isnan(a) || std::isnan(b)) return std::isnan(a) && std::isnan(b);
  return a == b || std::fabs(static_cast<double>(a) - static_cast<double>(b)) <= tolerance;
}

// The first item at which two lists differ by more than the tolerance, or -1.
template <class Number>
int first_difference(std::span<const Number> got, std::span<const Number> want,
                     double tolerance = 0) {
  if (got.size() != want.size()) return 0;
  for (std::size_t i = 0; i < got.size(); ++i)
    if (!agree(got[i], want[i], tolerance)) return static_cast<int>(i);
  return -1;
}
template <class Number>
int first_difference(const ColumnOf<Number>& got, const ColumnOf<Number>& want,
                     double tolerance = 0) {
  return first_difference(got.span(), want.span(), tolerance);
}

}  // namespace sim_test
