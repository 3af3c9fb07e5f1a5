#include "sweep_and_prune.h"

#include <cmath>

namespace sim {
namespace {

constexpr double kRoom = 0.1;    // of a radius
constexpr double kSpare = 1.5;  // times its radius, in a room that is too wide

}  // namespace

bool SweepAndPrune::fits(std::span<const Ball> balls) const {
  return std::ranges::all_of(swept_, [&](const Swept& each) {
    const Ball& now = balls[static_cast<std::size_t>(each.ball)];
    const double left = each.room.radius - now.radius;
    return left >= 0 && each.room.radius <= kSpare * now.radius &&
           (now.center - each.room.center).squaredNorm() <= left * left;
  });
}

void SweepAndPrune::sort(std::span<const Ball> balls) {
  Vec3 sum, squares;
  widest_ = 0;
  for (Swept& each : swept_) {
    each.room = balls[static_cast<std::size_t>(each.ball)];
    each.room.radius *= 1 + kRoom;
    widest_ = std::max(widest_, each.room.radius);
    sum += each.room.center;
  }
  const Vec3 mean = sum / std::max<double>(1, static_cast<double>(swept_.size()));
  for (const Swept& each : swept_)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double off = each.room.center[axis] - mean[axis];
      squares[axis] += off * off;
    }
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (squares[axis] > squares[axis_]) axis_ = axis;
  for (Swept& each : swept_) {
    const double low = each.room.center[axis_] - each.room.radius;
    each.low = low == low ? low : -HUGE_VAL;  // whatever bodies that run away have
  }
  std::ranges::sort(swept_, {}, &Swept::low);
}

}  // namespace sim
