// The broad phase of bodies: the pairs of balls that meet.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "core/math/vec3.h"

namespace sim {

struct Ball {
  Vec3 center;
  double radius = 0;  // m
};

// Sweep and prune along the axis on which the balls are spread most (Cohen, Lin, Manocha & Ponamgi
// (1995)): balls whose intervals on it overlap, and then those that do. Pairs are found with some
// room, and kept while each ball stays within its own.
class SweepAndPrune {
 public:
  using Pair = std::pair<int, int>;

  void take(int ball) { swept_.push_back({ball}); }  // it takes part, behind those before it

  // balls: of all numbers. Finds pairs again where one has left its room, or needs much less of it;
  // those for which `leave_out` is true are none.
  template <class LeaveOut>
  void update(std::span<const Ball> balls, const LeaveOut& leave_out) {
    if (fits(balls)) return;
    sort(balls);
    pairs_.clear();
    for (std::size_t k = 0; k < swept_.size(); ++k) {
      const Swept& one = swept_[k];
      const double high = one.low + 2 * one.room.radius;
      for (std::size_t l = k + 1; l < swept_.size() && !(swept_[l].low > high); ++l) {
        const Swept& other = swept_[l];
        if (meet(one.room, other.room) && !leave_out(one.ball, other.ball))
          pairs_.emplace_back(std::minmax(one.ball, other.ball));
      }
    }
    std::ranges::sort(pairs_);
  }

  // Ascending, each with the lower number first; more than those that meet now.
  std::span<const Pair> pairs() const { return pairs_; }
  std::span<const Pair> pairs_of(int first) const {
    return std::ranges::equal_range(pairs_, first, {}, &Pair::first);
  }

  // Calls take(ball) of all balls that come so near to x, m, and of some others.
  template <class Take>
  void each_near(const Vec3& x, double distance, const Take& take) const {
    const double low = x[axis_] - distance - 2 * widest_, high = x[axis_] + distance;
    for (auto each = std::ranges::lower_bound(swept_, low, {}, &Swept::low);
         each != swept_.end() && each->low <= high; ++each)
      take(each->ball);
  }

  static bool meet(const Ball& one, const Ball& other) {
    const double most = one.radius + other.radius;
    return !((one.center - other.center).squaredNorm() > most * most);
  }

 private:
  struct Swept {
    int ball = 0;
    double low = 0;          // m, the end of its room on the axis
    Ball room = {{}, -1.0};  // within which it keeps its pairs
  };
  bool fits(std::span<const Ball> balls) const;
  void sort(std::span<const Ball> balls);

  std::size_t axis_ = 0;
  double widest_ = 0;  // m, radius of a room
  std::vector<Swept> swept_;
  std::vector<Pair> pairs_;
};

}  // namespace sim
