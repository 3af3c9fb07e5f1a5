// Checks of a constraint against differences of its own equations.
#include <algorithm>
#include <cmath>

#include "core/base/array.h"
#include "core/base/layout.h"
#include "core/base/text.h"
#include "core/particles/constraints/constraint_solver.h"
#include "core/study/contract/examiner.h"

namespace sim::study::contract {
namespace {

constexpr int kHeld = 6;

// A few particles at a state that satisfies the constraint.
class ConstrainedCloud {
 public:
  ConstrainedCloud(const Plugin<Constraint>& plugin, const Params& params)
      : layout_(kHeld), x_(layout_.size()), masses_(kHeld, 1.0) {
    Elements elements;
    elements.arity = plugin.elements.arity;
    for (int i = 0; i + elements.arity <= kHeld; ++i)
      for (int corner = 0; corner < elements.arity; ++corner) elements.ids.push_back(i + corner);
    double seed = 0.5;
    for (int block = 0; block < 6; ++block)
      for (int i = 0; i < kHeld; ++i) {
        seed = std::fmod(997 * seed + 0.617, 1.0);
        layout_.block(x_.data(), block)[i] = 2 * seed - 1;
      }
    constraints_.add(made(plugin.make(params, elements), plugin), plugin.name, "", 0, view(0));
    constraints_.set_masses(masses_);
    memory_ = Array(constraints_.internal_size() + 1);
    constraints_.start(memory_.data());
    ConstraintSolver solver(constraints_);
    allowed_ = solver.project_state(kTime, view(0), layout_.axes(x_.data()),
                                    layout_.axes(x_.data(), 3), memory_.data(), false);
    if (allowed_) constraints_.follow(view(kTime), memory_.data());
  }

  bool allowed() const { return allowed_; }
  const RowList& rows() const { return constraints_.rows(); }

  // The curvature at kTime of the pairs of each row.
  std::vector<double> curvature() const {
    std::vector<double> pairs(rows().pairs());
    rows().write_curvature(view(kTime), memory_.data(), pairs);
    return pairs;
  }
  // The rows at time t on the straight paths of all particles from kTime on.
  RowValues at(double t) const {
    Array moved(layout_.size());
    std::copy_n(x_.data(), x_.size(), moved.data());
    for (int axis = 0; axis < 3; ++axis)
      for (int i = 0; i < kHeld; ++i)
        layout_.block(moved.data(), axis)[i] += (t - kTime) * layout_.block(x_.data(), 3 + axis)[i];
    return values(moved, t);
  }
  // The rows with one coordinate of one particle changed.
  RowValues beside(int i, int axis, double by) const {
    Array moved(layout_.size());
    std::copy_n(x_.data(), x_.size(), moved.data());
    layout_.block(moved.data(), axis)[i] += by;
    return values(moved, kTime);
  }
  double velocity(int i, int axis) const { return layout_.block(x_.data(), 3 + axis)[i]; }

  static constexpr double kTime = 0.25;  // s

 private:
  ParticleView view(double t) const { return view_of(x_, t); }
  ParticleView view_of(const Array& x, double t) const {
    const auto q = layout_.axes(x.data()), v = layout_.axes(x.data(), 3);
    return {kHeld, t, q[0], q[1], q[2], v[0], v[1], v[2], masses_.data(), {}};
  }
  RowValues values(const Array& x, double t) const {
    RowValues values(rows());
    values.evaluate(view_of(x, t), memory_.data());
    return values;
  }

  Layout layout_;
  Array x_, memory_;
  std::vector<double> masses_;
  Constraints constraints_;
  bool allowed_ = false;
};

// The largest difference, relative to the largest number or 1.
class Agreement {
 public:
  void compare(double value, double expected) {
    off_ = std::max(off_, std::fabs(value - expected));
    size_ = std::max(size_, std::fabs(expected));
  }
  void report(Examiner& examiner, const std::string& name) const {
    constexpr double kBound = 1e-5;
    examiner.check(name, off_ <= kBound * size_, "to " + brief(off_ / size_, 2));
  }

 private:
  double off_ = 0, size_ = 1;
};

void check_derivatives(const ConstrainedCloud& cloud, Examiner& examiner) {
  constexpr double kStep = 0x1p-13, kTime = ConstrainedCloud::kTime;
  const RowValues now = cloud.at(kTime), before = cloud.at(kTime - kStep),
                  after = cloud.at(kTime + kStep);
  const RowPattern& pattern = cloud.rows().pattern;
  Agreement gradient, rate, bias;
  for (std::size_t r = 0; r < now.phi().size(); ++r) {
    double along = now.drive()[r];
    for (int e = pattern.begin[r]; e < pattern.begin[r + 1]; ++e) {
      const auto at = static_cast<std::size_t>(e);
      const int i = pattern.ids[at];
      for (int axis = 0; axis < 3; ++axis) {
        const double g = now.gradient()[at][static_cast<std::size_t>(axis)];
        along += g * cloud.velocity(i, axis);
        gradient.compare(
            g, (cloud.beside(i, axis, kStep).phi()[r] - cloud.beside(i, axis, -kStep).phi()[r]) /
                   (2 * kStep));
      }
    }
    rate.compare(along, (after.phi()[r] - before.phi()[r]) / (2 * kStep));
    bias.compare(now.bias()[r],
                 (after.phi()[r] - 2 * now.phi()[r] + before.phi()[r]) / (kStep * kStep));
  }
  // The curvature is compared only if the constraint gives it, for the pairs of one row.
  const std::vector<double> curvature = cloud.curvature();
  Agreement second;
  std::size_t pair = 0;
  for (std::size_t r = 0; r < now.phi().size(); ++r)
    for (int a = pattern.begin[r]; a < pattern.begin[r + 1]; ++a)
      for (int b = a; b < pattern.begin[r + 1]; ++b) {
        const double given = curvature[pair++];
        if (given == 0) continue;
        const auto at = static_cast<std::size_t>(a);
        const int i = pattern.ids[static_cast<std::size_t>(b)];
        for (int axis = 0; axis < 3; ++axis) {
          const Vec3 found = (cloud.beside(i, axis, kStep).gradient()[at] -
                              cloud.beside(i, axis, -kStep).gradient()[at]) /
                             (2 * kStep);
          for (int other = 0; other < 3; ++other)
            second.compare(other == axis ? given : 0, found[static_cast<std::size_t>(other)]);
        }
      }
  second.report(examiner, "its curvature is that of phi where it gives one, by differences");
  gradient.report(examiner, "its gradient is that of phi, by differences");
  rate.report(examiner, "J v + drive is d phi / dt, by differences");
  bias.report(examiner, "its bias is d2 phi / dt2 without accelerations, by differences");
  examiner.check("the same bits again", same(now.phi(), cloud.at(kTime).phi()), "");
  examiner.hash(now.phi());
  examiner.hash(now.bias());
}

}  // namespace

void check_constraint(const Plugin<Constraint>& plugin, Contract& contract) {
  Examiner examiner(plugin, contract);
  examiner.group("evaluates", [&] {
    const ConstrainedCloud cloud(plugin, example_params(plugin));
    examiner.check("finds a state that obeys it", cloud.allowed(), "of some particles at random");
    if (cloud.allowed()) check_derivatives(cloud, examiner);
  });
  examiner.bounds([&](const Params& params) {
    const RowValues values = ConstrainedCloud(plugin, params).at(0);
    return std::vector<double>(values.phi().begin(), values.phi().end());
  });
}

}  // namespace sim::study::contract
