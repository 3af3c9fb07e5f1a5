// A plane: everything behind it is solid.
#include "core/plugin/plugin.h"
#include "core/plugin/sdf_collider.h"

namespace {

class Plane final : public sim::SdfCollider {
 public:
  explicit Plane(const sim::Params& params)
      : SdfCollider(params, params.vector("point")), normal_(params.vector("normal")) {
    const double length = normal_.stableNorm();
    if (!(length > 0))
      throw sim::Error(sim::ErrorKind::kScene, {"collider 'plane'", "", "its normal has no length",
                                                "give a direction, {0, 1, 0}"});
    normal_ /= length;
    if (params.has("motion") && params.motion("motion")->max_angular_speed() > 0 &&
        !(normal_.cross(params.motion("motion")->at(0, {0, 0, 0}).axis).norm() < 1e-12))
      throw sim::Error(sim::ErrorKind::kScene,
                       {"collider 'plane'", "", "it can turn about its normal only",
                        "give its motion the axis of the normal, or take a box"});
  }

 private:
  Distance distance(const sim::Vec3& x) const override { return {normal_.dot(x), normal_}; }

  sim::PrimitiveSurface plain_form() const override {
    return {.form = sim::PrimitiveSurface::Form::kPlane, .normal = normal_};
  }

  sim::RenderShape form() const override { return sim::plane_shape({0, 0, 0}, normal_); }

  double least(const sim::Vec3& middle, const sim::Vec3& half) const override {
    double gap = normal_.dot(middle);
    for (int axis = 0; axis < 3; ++axis) gap -= std::fabs(normal_[axis]) * half[axis];
    return gap;
  }

  sim::Vec3 normal_;
};

}  // namespace

SIM_PLUGIN(Collider, "plane") {
  registrar.add(sim::Plugin<sim::Collider>{
      {.name = "plane",
       .summary = "a plane; everything behind it is solid",
       .formula = "n.(x - point) >= thickness",
       .params = sim::solid_params({{.name = "point",
                                     .type = sim::ParamType::kVector,
                                     .default_value = sim::Vec3(0, 0, 0),
                                     .unit = "m",
                                     .doc = "a point of the plane, the center of its motion"},
                                    {.name = "normal",
                                     .type = sim::ParamType::kVector,
                                     .default_value = sim::Vec3(0, 1, 0),
                                     .doc = "points away from what is solid; any length but 0"}},
                                   false)},
      [](const sim::Params& params) { return std::make_unique<Plane>(params); }});
}
