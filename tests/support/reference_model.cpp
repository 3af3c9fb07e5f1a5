#include "tests/support/reference_model.h"

#include <cmath>
#include <stdexcept>

namespace sim_test {

ReferenceModel::ReferenceModel(const sim::SystemSpec& spec) {
  for (int i = 0; i < spec.particles->count(); ++i) {
    const sim::ParticleSpec p = spec.particles->at(i);
    state_.insert(state_.end(), p.position.begin(), p.position.end());
    state_.insert(state_.end(), p.velocity.begin(), p.velocity.end());
    masses_.push_back(p.mass);
  }
  pinned_.resize(masses_.size());
  for (const int i : spec.particles->pinned) {
    pinned_[static_cast<std::size_t>(i)] = true;
    for (int axis = 3; axis < 6; ++axis) state_[static_cast<std::size_t>(6 * i + axis)] = 0;
  }
  for (const sim::PartSpec& part : spec.forces) {
    if (part.plugin == "gravity") {
      gravity_ += std::get<sim::Vec3>(part.given.at("g"));
    } else if (part.plugin == "drag") {
      drag_ += std::get<double>(part.given.at("k"));
    } else if (part.plugin == "spring") {
      const double stiffness = std::get<double>(part.given.at("stiffness"));
      const auto given = part.given.find("damping");
      const double damping = given == part.given.end() ? 0 : std::get<double>(given->second);
      const auto own = [&](const char* name, const sim::Element& tie, double otherwise) {
        const auto column = part.elements.values.find(name);
        if (tie.index < 0 || column == part.elements.values.end()) return otherwise;
        const double value = column->second[static_cast<std::size_t>(tie.index)];
        return std::isnan(value) ? otherwise : value;
      };
      part.elements.for_each([&](const sim::Element& tie) {
        springs_.push_back({static_cast<std::size_t>(tie.ids[0]),
                            static_cast<std::size_t>(tie.ids[1]), own("stiffness", tie, stiffness),
                            own("rest", tie, tie.length), own("damping", tie, damping)});
      });
    } else {
      throw std::invalid_argument("the plain model has no force " + part.plugin);
    }
  }
}

std::vector<double> ReferenceModel::derivative(const std::vector<double>& state) const {
  std::vector<double> force(3 * masses_.size());
  for (const Spring& spring : springs_) {
    double d[3], squared = 0, approach = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      d[axis] = state[6 * spring.a + axis] - state[6 * spring.b + axis];
      squared += d[axis] * d[axis];
      approach += d[axis] * (state[6 * spring.a + 3 + axis] - state[6 * spring.b + 3 + axis]);
    }
    const double length = std::sqrt(squared);
    for (std::size_t axis = 0; axis < 3 && length > 0; ++axis) {
      const double f = -(spring.k * (length - spring.rest) + spring.damping * approach / length) *
                       d[axis] / length;
      force[3 * spring.a + axis] += f;
      force[3 * spring.b + axis] -= f;
    }
  }
  std::vector<double> out(state.size());
  for (std::size_t i = 0; i < masses_.size(); ++i) {
    if (pinned_[i]) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double v = state[6 * i + 3 + axis];
      out[6 * i + axis] = v;
      out[6 * i + 3 + axis] = (force[3 * i + axis] - drag_ * v) / masses_[i] + gravity_[axis];
    }
  }
  return out;
}

double ReferenceModel::kinetic(const std::vector<double>& state) const {
  double sum = 0;
  for (std::size_t i = 0; i < masses_.size(); ++i)
    for (std::size_t axis = 3; axis < 6 && !pinned_[i]; ++axis)
      sum += 0.5 * masses_[i] * state[6 * i + axis] * state[6 * i + axis];
  return sum;
}

double ReferenceModel::potential(const std::vector<double>& state) const {
  double sum = 0;
  for (const Spring& spring : springs_) {
    double squared = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double d = state[6 * spring.a + axis] - state[6 * spring.b + axis];
      squared += d * d;
    }
    const double stretch = std::sqrt(squared) - spring.rest;
    sum += 0.5 * spring.k * stretch * stretch;
  }
  for (std::size_t i = 0; i < masses_.size(); ++i)
    for (std::size_t axis = 0; axis < 3 && !pinned_[i]; ++axis)
      sum -= masses_[i] * gravity_[axis] * state[6 * i + axis];
  return sum;
}

void ReferenceModel::step(const std::string& method, double h) {
  const auto moved = [this](double by, const std::vector<double>& slope) {
    std::vector<double> state = state_;
    for (std::size_t i = 0; i < state.size(); ++i) state[i] += by * slope[i];
    return state;
  };
  const std::vector<double> k1 = derivative(state_);
  std::vector<double> slope = k1;
  if (method == "trapezoid") {
    const std::vector<double> k2 = derivative(moved(h, k1));
    for (std::size_t i = 0; i < slope.size(); ++i) slope[i] = (k1[i] + k2[i]) / 2;
  } else if (method == "rk4") {
    const std::vector<double> k2 = derivative(moved(h / 2, k1));
    const std::vector<double> k3 = derivative(moved(h / 2, k2));
    const std::vector<double> k4 = derivative(moved(h, k3));
    for (std::size_t i = 0; i < slope.size(); ++i)
      slope[i] = (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]) / 6;
  } else if (method != "euler") {
    throw std::invalid_argument("the plain model has no method " + method);
  }
  state_ = moved(h, slope);
}

}  // namespace sim_test
