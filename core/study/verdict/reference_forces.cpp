#include "core/study/verdict/reference_forces.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <set>

namespace sim::study {
namespace {

constexpr int kAll = 1024;                    // particles, up to which all are evaluated
constexpr int kEnd = 48;                      // of more, so many at each end
constexpr int kBlocks = 16, kBlockSize = 8;   // and in between
constexpr double kSquareUnderflows = 1e-140;  // m

// A plain loop over numbers: rooms outside of the steps are compiled with little optimisation.
double distance(const ParticleView& view, int a, int b, double d[3]) {
  d[0] = view.x[a] - view.x[b];
  d[1] = view.y[a] - view.y[b];
  d[2] = view.z[a] - view.z[b];
  return std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
}

// A number that the scene gives for all elements of a force; nan without one.
double given_number(const PartSpec& part, const std::string& name) {
  const auto given = part.given.find(name);
  if (given == part.given.end()) return std::nan("");
  if (const auto* const integer = std::get_if<std::int64_t>(&given->second))
    return static_cast<double>(*integer);
  const double* const number = std::get_if<double>(&given->second);
  return number ? *number : std::nan("");
}

bool given_flag(const PartSpec& part, const std::string& name) {
  const auto given = part.given.find(name);
  const bool* const flag = given == part.given.end() ? nullptr : std::get_if<bool>(&given->second);
  return flag && *flag;
}

// The numbers that each element gives for itself, or null.
const double* own_numbers(const PartSpec& part, const std::string& name) {
  const auto column = part.elements.values.find(name);
  return column == part.elements.values.end() ? nullptr : column->second.data();
}

}  // namespace

ReferenceForces::ReferenceForces(const SystemSpec& spec, const ParticleSystem& particles,
                                 const ParticleView& view, const std::vector<std::string>& off) {
  choose_ids(view);
  // The forces of the system are those of the scene in their order, if all are on.
  known_ = std::ranges::none_of(spec.forces, [&](const PartSpec& part) {
    return !part.switch_name.empty() && std::ranges::binary_search(off, part.switch_name);
  });
  for (std::size_t f = 0; known_ && f < particles.forces().size(); ++f) {
    Force& force = *particles.forces()[f];
    Potential potential{&force};
    if (const auto affine = force.affine()) {
      gravity_ += affine->acceleration;
      drag_ += affine->damping;
      for (int i = 0; i < view.n; ++i) {
        const double energy = -view.free_mass(i) * affine->acceleration.dot(view.position(i));
        potential.energy += energy;
        potential.scale += std::abs(energy);
      }
    }
    if (force.springs()) {
      known_ = !force.breakable() && f < spec.forces.size() &&
               !std::isnan(given_number(spec.forces[f], "stiffness"));
      if (known_) add_springs(spec, spec.forces[f], view, potential);
    }
    if (force.affine() || (force.springs() && view.n <= kAll)) potentials_.push_back(potential);
  }
}

void ReferenceForces::choose_ids(const ParticleView& view) {
  place_.assign(static_cast<std::size_t>(view.n), -1);
  const auto choose = [&](int begin, int end) {
    for (int i = std::max(begin, 0); i < std::min(end, view.n); ++i) {
      if (!view.free(i) || place_[static_cast<std::size_t>(i)] >= 0) continue;
      place_[static_cast<std::size_t>(i)] = static_cast<int>(ids_.size());
      ids_.push_back(i);
    }
  };
  if (view.n <= kAll) return choose(0, view.n);
  choose(0, kEnd);
  choose(view.n - kEnd, view.n);
  for (int block = 1; block <= kBlocks; ++block) {
    const int begin = static_cast<int>(static_cast<std::int64_t>(view.n) * block / (kBlocks + 1));
    choose(begin, begin + kBlockSize);
  }
}

void ReferenceForces::add_springs(const SystemSpec& spec, const PartSpec& part,
                                  const ParticleView& view, Potential& potential) {
  const auto name = part.given.find("family");
  const auto* const text =
      name == part.given.end() ? nullptr : std::get_if<std::string>(&name->second);
  families_.push_back(text ? *text : part.plugin);
  const double stiffness = given_number(part, "stiffness"), rest = given_number(part, "rest");
  const double* const own_stiffness = own_numbers(part, "stiffness");
  const double* const own_rest = own_numbers(part, "rest");
  const auto own = [](const double* numbers, const Element& tie, double otherwise) {
    return numbers && tie.index >= 0 && !std::isnan(numbers[tie.index]) ? numbers[tie.index]
                                                                        : otherwise;
  };
  const SpringSense sense = given_flag(part, "tension_only")       ? SpringSense::kTension
                            : given_flag(part, "compression_only") ? SpringSense::kCompression
                                                                   : SpringSense::kBoth;
  const bool whole = view.n <= kAll;
  part.elements.for_each([&](const Element& tie) {
    const int a = tie.ids[0], b = tie.ids[1];
    if (!whole && place_[static_cast<std::size_t>(a)] < 0 &&
        place_[static_cast<std::size_t>(b)] < 0)
      return;
    const double k = own(own_stiffness, tie, stiffness);
    double r = own(own_rest, tie, std::isnan(rest) ? tie.length : rest);
    if (std::isnan(r)) r = (spec.particles->at(a).position - spec.particles->at(b).position).norm();
    if (whole) {
      double d[3];
      const double length = distance(view, a, b, d);
      if (!slack(sense, length, r)) potential.energy += 0.5 * k * (length - r) * (length - r);
      potential.scale += k * (length * length + r * r);
    }
    add_tie(a, b, k, r, sense);
    add_tie(b, a, k, r, sense);
  });
}

void ReferenceForces::add_tie(int from, int to, double stiffness, double rest, SpringSense sense) {
  const int k = place_[static_cast<std::size_t>(from)];
  if (k >= 0)
    ties_.push_back(
        {static_cast<std::size_t>(k), to, families_.size() - 1, stiffness, rest, sense});
}

std::vector<ReferenceForces::Sum> ReferenceForces::forces(const ParticleView& view) const {
  std::vector<Sum> sums(ids_.size());
  for (std::size_t k = 0; k < ids_.size(); ++k) {
    const int i = ids_[k];
    const Vec3 weight = view.mass[i] * gravity_, friction = drag_ * view.velocity(i);
    sums[k] = {weight - friction, weight.norm() + friction.norm()};
  }
  for (const Tie& tie : ties_) {
    double d[3];
    const double length = distance(view, ids_[tie.k], tie.to, d);
    const bool together = d[0] == 0 && d[1] == 0 && d[2] == 0;
    if (together) continue;
    Sum& sum = sums[tie.k];
    sum.scale += tie.stiffness * (length + tie.rest);
    if (length > kSquareUnderflows && slack(tie.sense, length, tie.rest)) continue;
    // Scalar code is unreliable where a square underflows and, by itself, where one overflows.
    const double s =
        length > kSquareUnderflows ? tie.stiffness * (1 - tie.rest / length) : HUGE_VAL;
    for (int axis = 0; axis < 3; ++axis) sum.force[axis] -= s * d[axis];
  }
  return sums;
}

std::string ReferenceForces::springs_of(std::size_t k, const ParticleView& view,
                                        const Vec3& off) const {
  constexpr double kAlong = 0.999;  // of the cosine
  std::set<std::string> all, along;
  for (const Tie& tie : ties_) {
    if (tie.k != k) continue;
    const Vec3 d = view.position(ids_[k]) - view.position(tie.to);
    all.insert(families_[tie.family]);
    if (std::abs(d.dot(off)) > kAlong * d.norm() * off.norm()) along.insert(families_[tie.family]);
  }
  std::string text;
  for (const std::string& name : along.empty() ? all : along)
    text += (text.empty() ? "'" : ", '") + name + "'";
  return text;
}

}  // namespace sim::study
