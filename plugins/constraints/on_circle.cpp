// Beads on a hoop, which may move and rotate.
#include <vector>

#include "core/particles/constraints/driven.h"
#include "core/plugin/constraint_params.h"
#include "core/plugin/plugin.h"

namespace {

class OnCircle final : public sim::Constraint {
 public:
  OnCircle(const sim::Params& params, const sim::Elements& on)
      : ids_(on.ids),
        center_(params.motion("center")),
        axis_(params.motion("axis")),
        radius_(params.number("radius")) {
    const auto refuse = [](const char* why, const char* remedy) {
      throw sim::Error(sim::ErrorKind::kScene, {"constraint 'on_circle'", "", why, remedy});
    };
    if (!(radius_ > 0)) refuse("its radius is 0", "give a radius > 0 in m, or pin the particle");
    if (!(axis_.place(0).norm() > 0)) refuse("its axis is 0", "give the direction across the hoop");
  }

  sim::RowPattern pattern() const override { return sim::RowPattern::of_each(ids_, 2); }

  // With d = x - c(t), w = d':  n.d = 0 for n = axis / |axis|, and (|d|^2 - R^2) / 2R = 0.
  //   (n.d)'' = n.x'' - n.c'' + 2 n'.w + n''.d
  void evaluate(const sim::ParticleView& p, const sim::Rows& rows) const override {
    const sim::Driven::At center = center_.at(p.t);
    const sim::Driven::At n = unit(axis_.at(p.t));
    for (std::size_t k = 0; k < ids_.size(); ++k) {
      const sim::Vec3 d = p.position(ids_[k]) - center.x, w = p.velocity(ids_[k]) - center.v;
      const std::size_t in = 2 * k;
      rows.phi[in] = n.x.dot(d);
      rows.gradient[in] = n.x;
      rows.drive[in] = n.v.dot(d) - n.x.dot(center.v);
      rows.bias[in] = 2 * n.v.dot(w) + n.a.dot(d) - n.x.dot(center.a);
      sim::write_radial_row(rows, in + 1, d, w, center, radius_);
    }
  }

  bool moves() const override { return center_.moves() || axis_.moves(); }
  std::string name(int row) const override {
    return "particle " + std::to_string(ids_[static_cast<std::size_t>(row / 2)]) +
           (row % 2 == 0 ? ", across the hoop" : ", along its radius");
  }

 private:
  // n = a / |a|:  n' = (a' - (n.a') n) / |a|,
  // n'' = (a'' - (n.a'') n - 2 (n.a') n') / |a| - |n'|^2 n
  static sim::Driven::At unit(const sim::Driven::At& a) {
    const double inverse = 1 / a.x.norm();
    const sim::Vec3 n = inverse * a.x, first = inverse * (a.v - n.dot(a.v) * n);
    const sim::Vec3 second =
        inverse * (a.a - n.dot(a.a) * n - 2 * n.dot(a.v) * first) - first.squaredNorm() * n;
    return {n, first, second};
  }

  std::vector<int> ids_;
  sim::Driven center_, axis_;
  double radius_;
};

}  // namespace

SIM_PLUGIN(Constraint, "on_circle") {
  registrar.add(sim::Plugin<sim::Constraint>{
      {.name = "on_circle",
       .summary = "beads on a hoop",
       .formula = "|x - center(t)| = radius,  axis(t).(x - center(t)) = 0",
       .params = sim::constraint_params(
           {{.name = "radius", .unit = "m", .doc = "radius", .required = true, .min = 0},
            {.name = "center",
             .type = sim::ParamType::kPath,
             .default_value = sim::Vec3(0, 0, 0),
             .unit = "m",
             .doc = "its center, or a function(t) that returns it"},
            {.name = "axis",
             .type = sim::ParamType::kPath,
             .default_value = sim::Vec3(0, 0, 1),
             .doc = "direction across the hoop, or a function(t) that returns it"}}),
       .elements = {.arity = 1, .name = "particle"}},
      [](const sim::Params& params, const sim::Elements& on) {
        return std::make_unique<OnCircle>(params, on);
      }});
}
