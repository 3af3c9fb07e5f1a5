#include "core/session/difference.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace sim {
namespace {

// Maps doubles to integers in the same order.
std::uint64_t rank(double value) {
  constexpr std::uint64_t kSign = std::uint64_t{1} << 63;
  const auto bits = std::bit_cast<std::uint64_t>(value);
  return bits & kSign ? kSign - (bits & ~kSign) : kSign + bits;
}

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

// Calls visit(difference) for every number that differs until it answers false.
template <class Visit>
void compare(const Simulation& a, const Simulation& b, Visit visit) {
  const StatePart *part = nullptr, *same = nullptr;
  a.shape().each([&](const StateNumber& number) {
    if (part != number.part) {
      part = number.part;
      same = b.shape().find(part->name);
    }
    if (!same || same->count != part->count) return true;
    const double left = a.state()[number.at];
    const double right = b.state()[same->at(number.item, number.component)];
    return same_bits(left, right) ||
           visit({static_cast<int>(number.item), number.part->item, number.name(), left, right});
  });
}

}  // namespace

double Difference::absolute() const { return std::abs(a - b); }

double Difference::relative() const {
  const double size = std::max(std::abs(a), std::abs(b));
  return size > 0 ? absolute() / size : 0;
}

std::uint64_t Difference::ulps() const {
  const std::uint64_t ra = rank(a), rb = rank(b);
  return ra > rb ? ra - rb : rb - ra;
}

std::optional<Difference> first_difference(const Simulation& a, const Simulation& b) {
  std::optional<Difference> first;
  compare(a, b, [&](const Difference& found) {
    first = found;
    return false;
  });
  return first;
}

std::optional<Difference> largest_difference(const Simulation& a, const Simulation& b) {
  std::optional<Difference> largest;
  compare(a, b, [&](const Difference& found) {
    if (!largest || found.absolute() > largest->absolute()) largest = found;
    return true;
  });
  return largest;
}

}  // namespace sim
