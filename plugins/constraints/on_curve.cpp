// Beads on a wire of any form, which may move.
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/base/text.h"
#include "core/math/differences.h"
#include "core/plugin/constraint_params.h"
#include "core/plugin/plugin.h"

namespace {

class OnCurve final : public sim::Constraint {
 public:
  OnCurve(const sim::Params& params, const sim::Elements& on)
      : ids_(on.ids),
        curve_(params.curve("curve")),
        from_(params.number("from")),
        to_(params.number("to")),
        start_(ids_.size()) {
    if (!(from_ < to_))
      throw sim::Error(sim::ErrorKind::kScene,
                       {"constraint 'on_curve'", "", "it has no places between 'from' and 'to'",
                        "give from < to"});
  }

  // Finds the parameter of each bead on the wire, and difference steps that suit the wire there.
  void bind(const sim::ParticleView& start) override {
    double ds = HUGE_VAL, dt = HUGE_VAL;
    const auto norm = [](const sim::Vec3& d) { return d.norm(); };
    for (std::size_t k = 0; k < ids_.size(); ++k) {
      const double s = start_[k] = nearest(start.position(ids_[k]));
      const auto along = [&](double at) { return curve_->at(at, 0); };
      const auto in_time = [&](double at) { return curve_->at(s, at); };
      ds = std::min(ds, sim::NinePoints::best(along, s, norm).step());
      if (moves()) dt = std::min(dt, sim::NinePoints::best(in_time, 0, norm).step());
    }
    ds_ = ds;
    dt_ = std::min(dt, 1.0);
  }

  sim::RowPattern pattern() const override { return sim::RowPattern::of_each(ids_, 2); }

  // The nearest point of the wire, at parameter s, has (x - r).r_s = 0. With two normals n there
  //   n.(x - r(s, t)) = 0,  n.x'' = n.(r_ss s'^2 + 2 r_st s' + r_tt)
  void evaluate(const sim::ParticleView& p, const sim::Rows& rows) const override {
    for (std::size_t k = 0; k < ids_.size(); ++k) {
      const sim::Vec3 x = p.position(ids_[k]);
      const Piece r = near(x, p.internal[2 * k], p.t);
      const sim::Vec3 along = r.first / r.first.norm();
      sim::Vec3 across;
      across[static_cast<std::size_t>(p.internal[2 * k + 1])] = 1;
      across = (across - across.dot(along) * along).normalized();
      const sim::Vec3 normals[2] = {across, along.cross(across)};

      sim::Vec3 velocity, turn;  // of the point, and the acceleration that keeps it on the wire
      if (moves()) {
        velocity = sim::NinePoints(dt_).first([&](double t) { return curve_->at(r.s, t); }, p.t);
        const double rate = along.dot(p.velocity(ids_[k]) - velocity) / r.first.norm();
        const double step = std::min(dt_, ds_ / std::max(std::fabs(rate), 1e-300));
        turn = sim::NinePoints(step).second(
            [&](double t) { return curve_->at(r.s + rate * t, p.t + t); }, 0);
      } else {
        const double rate = along.dot(p.velocity(ids_[k])) / r.first.norm();
        turn = rate * rate * r.second;
      }
      for (std::size_t j = 0; j < 2; ++j) {
        const std::size_t row = 2 * k + j;
        rows.phi[row] = r.kink ? std::nan("") : normals[j].dot(x - r.x);
        rows.gradient[row] = normals[j];
        rows.drive[row] = -normals[j].dot(velocity);
        rows.bias[row] = -normals[j].dot(turn);
      }
      if (r.kink)
        complaint_ =
            "its wire has a kink or an end near s = " + sim::brief(r.s) + "; it must be smooth";
    }
  }

  bool moves() const override { return curve_->moves(); }
  // Two internal variables a bead: its parameter, and an axis across the wire, which stays the same
  // within a step.
  int internal_size() const override { return 2 * static_cast<int>(ids_.size()); }
  void start(std::span<double> memory) const override {
    for (std::size_t k = 0; k < ids_.size(); ++k) remember(piece(start_[k], 0), &memory[2 * k]);
  }
  void follow(const sim::ParticleView& p, std::span<double> memory) const override {
    for (std::size_t k = 0; k < ids_.size(); ++k)
      remember(near(p.position(ids_[k]), memory[2 * k], p.t), &memory[2 * k]);
  }
  std::string name(int row) const override {
    return "particle " + std::to_string(ids_[static_cast<std::size_t>(row / 2)]);
  }
  std::string complaint() const override { return complaint_; }

 private:
  struct Piece {
    double s = 0;
    sim::Vec3 x, first, second;  // r, r_s, r_ss
    bool kink = false;
  };

  Piece piece(double s, double t) const {
    const auto nine = sim::NinePoints(ds_).values([&](double at) { return curve_->at(at, t); }, s);
    Piece r{s, nine.value, nine.first(), nine.second(), false};
    r.kink = !((nine.first_of_fourth_order() - r.first).norm() +
                   ds_ * (nine.second_of_fourth_order() - r.second).norm() <=
               1e-2 * r.first.norm());
    return r;
  }

  // Newton's method from a nearby parameter; a step goes no further than its first-order estimate.
  Piece near(const sim::Vec3& x, double s, double t) const {
    constexpr int kMost = 40;
    Piece r = piece(s, t);
    for (int turn = 0; turn < kMost && !r.kink; ++turn) {
      const sim::Vec3 d = x - r.x;
      const double slope = r.first.squaredNorm();
      const double step = d.dot(r.first) / std::max(slope - d.dot(r.second), 0.5 * slope);
      if (!(std::fabs(step) > 4e-16 * std::max(1.0, std::fabs(r.s)))) break;
      r = piece(r.s + step, t);
    }
    return r;
  }

  static void remember(const Piece& r, double* memory) {
    const sim::Vec3 along = r.first.cwiseAbs();
    std::size_t axis = 0;
    for (std::size_t other = 1; other < 3; ++other)
      if (along[other] < along[axis]) axis = other;
    memory[0] = r.s;
    memory[1] = static_cast<double>(axis);
  }

  double nearest(const sim::Vec3& x) const {
    constexpr int kPlaces = 20000;
    double best = from_, least = HUGE_VAL;
    for (int j = 0; j <= kPlaces; ++j) {
      const double s = from_ + (to_ - from_) * j / kPlaces;
      const double away = (curve_->at(s, 0) - x).squaredNorm();
      if (!(away < least)) continue;
      least = away;
      best = s;
    }
    return best;
  }

  std::vector<int> ids_;
  std::shared_ptr<const sim::Curve> curve_;
  double from_, to_, ds_ = 0x1p-5, dt_ = 0x1p-5;
  std::vector<double> start_;
  mutable std::string complaint_;
};

}  // namespace

SIM_PLUGIN(Constraint, "on_curve") {
  registrar.add(sim::Plugin<sim::Constraint>{
      {.name = "on_curve",
       .summary = "beads on a wire of any smooth form",
       .formula = "x = r(s, t) for some s",
       .params = sim::constraint_params(
           {{.name = "curve",
             .type = sim::ParamType::kCurve,
             .unit = "m",
             .doc = "function(s) that returns a point {x, y, z} of the wire, or function(s, t)",
             .required = true},
            {.name = "from",
             .default_value = -100.0,
             .doc = "the least s that is looked at to find where the beads are at the start"},
            {.name = "to", .default_value = 100.0, .doc = "the largest"}}),
       .elements = {.arity = 1, .name = "particle"}},
      [](const sim::Params& params, const sim::Elements& on) {
        return std::make_unique<OnCurve>(params, on);
      }});
}
