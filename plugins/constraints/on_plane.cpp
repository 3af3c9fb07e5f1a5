// Particles stay on a plane, which may move.
#include <vector>

#include "core/particles/constraints/driven.h"
#include "core/plugin/constraint_params.h"
#include "core/plugin/plugin.h"

namespace {

class OnPlane final : public sim::Constraint {
 public:
  OnPlane(const sim::Params& params, const sim::Elements& on)
      : ids_(on.ids),
        point_(params.motion("point")),
        normal_(params.vector("normal").normalized()) {
    if (normal_ == sim::Vec3::Zero())
      throw sim::Error(sim::ErrorKind::kScene, {"constraint 'on_plane'", "", "its normal is 0",
                                                "give the direction across the plane"});
  }

  sim::RowPattern pattern() const override { return sim::RowPattern::of_each(ids_); }

  void evaluate(const sim::ParticleView& p, const sim::Rows& rows) const override {
    const sim::Driven::At point = point_.at(p.t);
    for (std::size_t r = 0; r < ids_.size(); ++r) {
      rows.phi[r] = normal_.dot(p.position(ids_[r]) - point.x);
      rows.gradient[r] = normal_;
      rows.drive[r] = -normal_.dot(point.v);
      rows.bias[r] = -normal_.dot(point.a);
    }
  }

  bool moves() const override { return point_.moves(); }
  std::string name(int row) const override {
    return "particle " + std::to_string(ids_[static_cast<std::size_t>(row)]);
  }

 private:
  std::vector<int> ids_;
  sim::Driven point_;
  sim::Vec3 normal_;
};

}  // namespace

SIM_PLUGIN(Constraint, "on_plane") {
  registrar.add(sim::Plugin<sim::Constraint>{
      {.name = "on_plane",
       .summary = "particles stay on a plane",
       .formula = "normal.(x - point(t)) = 0",
       .params =
           sim::constraint_params({{.name = "point",
                                    .type = sim::ParamType::kPath,
                                    .default_value = sim::Vec3(0, 0, 0),
                                    .unit = "m",
                                    .doc = "a point of it, or a function(t) that returns one"},
                                   {.name = "normal",
                                    .type = sim::ParamType::kVector,
                                    .default_value = sim::Vec3(0, 1, 0),
                                    .doc = "direction across it"}}),
       .elements = {.arity = 1, .name = "particle"}},
      [](const sim::Params& params, const sim::Elements& on) {
        return std::make_unique<OnPlane>(params, on);
      }});
}
