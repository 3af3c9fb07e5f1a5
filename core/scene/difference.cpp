#include "core/scene/difference.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace sim {
namespace {

// Doubles in their order as integers in theirs.
std::uint64_t rank(double value) {
  constexpr std::uint64_t kSign = std::uint64_t{1} << 63;
  const auto bits = std::bit_cast<std::uint64_t>(value);
  return bits & kSign ? kSign - (bits & ~kSign) : kSign + bits;
}

// Calls visit(id, quantity, a, b) for every number until it answers false.
template <class Visit>
void compare(const Simulation& a, const Simulation& b, Visit visit) {
  constexpr const char* kPosition[] = {"x", "y", "z"};
  constexpr const char* kVelocity[] = {"vx", "vy", "vz"};
  if (a.flat()) {
    for (int i = 0; i < a.components(); ++i)
      if (!visit(i, "component", a.component(i), b.component(i))) return;
    return;
  }
  for (int i = 0; i < a.particles(); ++i) {
    const Vec3 xa = a.position(i), xb = b.position(i), va = a.velocity(i), vb = b.velocity(i);
    for (int axis = 0; axis < 3; ++axis)
      if (!visit(i, kPosition[axis], xa[axis], xb[axis])) return;
    for (int axis = 0; axis < 3; ++axis)
      if (!visit(i, kVelocity[axis], va[axis], vb[axis])) return;
  }
}

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
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
  compare(a, b, [&](int id, const char* quantity, double left, double right) {
    if (!same_bits(left, right)) first = {id, quantity, left, right};
    return !first;
  });
  return first;
}

std::optional<Difference> largest_difference(const Simulation& a, const Simulation& b) {
  std::optional<Difference> largest;
  compare(a, b, [&](int id, const char* quantity, double left, double right) {
    if (!same_bits(left, right) && (!largest || std::abs(left - right) > largest->absolute()))
      largest = {id, quantity, left, right};
    return true;
  });
  return largest;
}

}  // namespace sim
