// Landing without restitution, impact after impact within a step.
#pragma once

#include <span>
#include <vector>

#include "contact_solver.h"
#include "core/base/thread_pool.h"
#include "resting_solver.h"

namespace sim {

// Points land in the order of their times of impact: each impact is solved with all points that
// touch then, before what it changes lands in turn. An edge may so leave the ground again when the
// next one lands (Housner (1963), Bull. Seismol. Soc. Am. 53, 403-417).
class LandingSolver {
 public:
  // The last impact of a step of h is left to resting contact: its points are active, with their
  // times and arms at that impact. tolerance: of impacts, relative to the fastest approach.
  void solve(std::span<SolverBody> bodies, std::span<ContactPoint> contacts, double h,
             double tolerance, RestingSolver& resting, ThreadPool& pool);

 private:
  double gap_at(const ContactPoint& m, double time) const;
  double next_touch(const ContactPoint& m) const;
  double unknown(const ContactPoint& m, double time) const;
  void hold(const ContactPoint& m, double time);
  bool collect_impact(std::span<ContactPoint> contacts);

  std::span<SolverBody> bodies_;
  double now_ = 0, fastest_ = 0;  // s, before the end of the step; m/s
  std::vector<double> held_;      // s, before the end: since when something touches each body
  std::vector<ContactPoint> impact_;
};

}  // namespace sim
