// Particles keep their distance from a point, which may move.
#include <algorithm>
#include <vector>

#include "core/particles/constraints/driven.h"
#include "core/plugin/constraint_params.h"
#include "core/plugin/plugin.h"

namespace {

class OnSphere final : public sim::Constraint {
 public:
  OnSphere(const sim::Params& params, const sim::Elements& on)
      : ids_(on.ids), center_(params.motion("center")), radius_(params.number("radius")) {
    if (!(radius_ > 0))
      throw sim::Error(sim::ErrorKind::kScene, {"constraint 'on_sphere'", "", "its radius is 0",
                                                "give a radius > 0 in m, or pin the particle"});
  }

  sim::RowPattern pattern() const override { return sim::RowPattern::of_each(ids_); }

  void evaluate(const sim::ParticleView& p, const sim::Rows& rows) const override {
    const sim::Driven::At center = center_.at(p.t);
    for (std::size_t r = 0; r < ids_.size(); ++r) {
      const sim::Vec3 d = p.position(ids_[r]) - center.x, w = p.velocity(ids_[r]) - center.v;
      sim::write_radial_row(rows, r, d, w, center, radius_);
    }
  }

  void curvature(const sim::ParticleView& /*view*/, double* pairs) const override {
    std::fill_n(pairs, ids_.size(), 1 / radius_);
  }

  bool moves() const override { return center_.moves(); }
  std::string name(int row) const override {
    return "particle " + std::to_string(ids_[static_cast<std::size_t>(row)]);
  }

 private:
  std::vector<int> ids_;
  sim::Driven center_;
  double radius_;
};

}  // namespace

SIM_PLUGIN(Constraint, "on_sphere") {
  registrar.add(sim::Plugin<sim::Constraint>{
      {.name = "on_sphere",
       .summary = "particles keep their distance from a point, as on a rod from it",
       .formula = "|x - center(t)| = radius",
       .params = sim::constraint_params(
           {{.name = "radius", .unit = "m", .doc = "radius", .required = true, .min = 0},
            {.name = "center",
             .type = sim::ParamType::kPath,
             .default_value = sim::Vec3(0, 0, 0),
             .unit = "m",
             .doc = "its center, or a function(t) that returns it"}}),
       .elements = {.arity = 1, .name = "particle"}},
      [](const sim::Params& params, const sim::Elements& on) {
        return std::make_unique<OnSphere>(params, on);
      }});
}
