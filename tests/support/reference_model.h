// The same physics by the plainest loops there are, to compare the kernel with.
#pragma once

#include <string>
#include <vector>

#include "core/scene/scene_spec.h"

namespace sim_test {

// Steps a second-order scene made of gravity, drag and springs, damped or not, whose ties and grids
// say their rest lengths. Spring by spring, stage by stage, nothing shared with the kernel but the
// description.
class ReferenceModel {
 public:
  explicit ReferenceModel(const sim::SystemSpec& spec);

  void step(const std::string& method, double h);  // euler, trapezoid or rk4
  // x y z vx vy vz of one particle after the other.
  const std::vector<double>& state() const { return state_; }
  std::vector<double> derivative(const std::vector<double>& state) const;
  double kinetic(const std::vector<double>& state) const;    // J
  double potential(const std::vector<double>& state) const;  // J, of springs and gravity

 private:
  struct Spring {
    std::size_t a, b;
    double k, rest, damping;
  };

  std::vector<double> state_, masses_;
  std::vector<bool> pinned_;
  std::vector<Spring> springs_;
  sim::Vec3 gravity_ = sim::Vec3::Zero();
  double drag_ = 0;
};

}  // namespace sim_test
