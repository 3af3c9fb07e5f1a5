// Trails: the ways of chosen particles, and of the centers of bodies, through a run.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/picture/look.h"
#include "core/picture/model.h"

namespace sim {

struct Trail {
  ModelPoint point;
  unsigned colour;  // 0xRRGGBB
};

// The trails of a system that the look asks for, each in its own colour, in its order; particles
// and bodies that the system does not have are left out.
std::vector<Trail> trails_of(const Model& model, const Look& look);

// Throws Error{kUsage} for a trail of a particle or body that no system has.
void check_trails(std::span<const Model> models, const Look& look);

// The particle that leaves a trail where nobody chose one: the last free one, where there are few;
// or -1.
int own_trail(const Model& model, const Look& look);

// Follows the points that leave trails from step to step. Between two steps a path is the cubic
// Hermite interpolant of positions and velocities, sampled more densely where it bends.
class TrailRecorder {
 public:
  TrailRecorder(const Model& model, const Look& look);

  bool any() const { return !trails_.empty(); }
  // The points of each path from the last call to the present state, until the next one.
  struct Point {
    Vec3 x;        // m
    bool goes_on;  // straight on from the point before, which may be left out
  };
  const std::vector<std::vector<Point>>& follow(const Simulation& system);

 private:
  struct State {
    Vec3 x, v, direction{0, 0, 0};  // m, m/s; in which the path left the last point
  };
  State look_at(const Simulation& system, const ModelPoint& point) const;

  std::vector<Trail> trails_;
  bool second_order_;
  double t_ = 0;               // s
  std::vector<State> before_;  // of each
  std::vector<std::vector<Point>> points_;
};

}  // namespace sim
