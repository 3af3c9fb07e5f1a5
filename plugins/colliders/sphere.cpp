// A sphere, solid within, or a hollow one.
#include "core/plugin/plugin.h"
#include "core/plugin/sdf_collider.h"

namespace {

class Sphere final : public sim::SdfCollider {
 public:
  explicit Sphere(const sim::Params& params)
      : SdfCollider(params, params.vector("center")), radius_(params.number("radius")) {
    if (!(radius_ > 0))
      throw sim::Error(sim::ErrorKind::kScene,
                       {"collider 'sphere'", "", "its radius is 0", "give a radius > 0 in m"});
  }

 private:
  Distance distance(const sim::Vec3& x) const override {
    const double length = x.norm();
    return {length - radius_, length > 0 ? sim::Vec3(x / length) : sim::Vec3(0, 1, 0)};
  }

  sim::PrimitiveSurface plain_form() const override {
    return {.form = sim::PrimitiveSurface::Form::kSphere, .radius = radius_};
  }

  sim::RenderShape form() const override {
    sim::RenderShape shape{.form = sim::RenderShape::Form::kSphere};
    shape.radius = radius_;
    return shape;
  }

  // The distance from the point of the box that is nearest to the center.
  double least(const sim::Vec3& middle, const sim::Vec3& half) const override {
    sim::Vec3 nearest;
    for (int axis = 0; axis < 3; ++axis)
      nearest[axis] = std::max(0.0, std::fabs(middle[axis]) - half[axis]);
    const double length = nearest.norm();
    return length > 0 ? length - radius_ : -radius_;
  }

  double radius_;
};

}  // namespace

SIM_PLUGIN(Collider, "sphere") {
  registrar.add(sim::Plugin<sim::Collider>{
      {.name = "sphere",
       .summary = "a solid sphere, or a hollow one",
       .formula = "|x - center| >= radius + thickness;  inside: <= radius - thickness",
       .params = sim::solid_params(
           {{.name = "radius", .unit = "m", .doc = "radius", .required = true, .min = 0},
            {.name = "center",
             .type = sim::ParamType::kVector,
             .default_value = sim::Vec3(0, 0, 0),
             .unit = "m",
             .doc = "where it is at rest"}})},
      [](const sim::Params& params) { return std::make_unique<Sphere>(params); }});
}
