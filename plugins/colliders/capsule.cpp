// A capsule: all points near a straight line from a to b.
#include "core/plugin/plugin.h"
#include "core/plugin/sdf_collider.h"

namespace {

class Capsule final : public sim::SdfCollider {
 public:
  explicit Capsule(const sim::Params& params)
      : SdfCollider(params, 0.5 * (params.vector("a") + params.vector("b"))),
        half_(0.5 * (params.vector("b") - params.vector("a"))),
        radius_(params.number("radius")) {
    if (!(radius_ > 0))
      throw sim::Error(sim::ErrorKind::kScene,
                       {"collider 'capsule'", "", "its radius is 0", "give a radius > 0 in m"});
    const double length = half_.norm();
    if (length > 0) axis_ = half_ / length;
    length_ = length;
  }

 private:
  // The distance from the nearest point of the line; on the line itself outward along one of its
  // normals.
  Distance distance(const sim::Vec3& x) const override {
    const sim::Vec3 d = x - std::clamp(axis_.dot(x), -length_, length_) * axis_;
    const double gap = d.norm();
    if (gap > 0) return {gap - radius_, d / gap};
    const sim::Vec3 other = std::fabs(axis_[1]) < 0.9 ? sim::Vec3(0, 1, 0) : sim::Vec3(1, 0, 0);
    return {-radius_, (other - other.dot(axis_) * axis_).normalized()};
  }

  sim::RenderShape form() const override {
    sim::RenderShape shape{.form = sim::RenderShape::Form::kCapsule};
    shape.axes[0] = half_;
    shape.radius = radius_;
    return shape;
  }

  double turning_radius(const sim::Vec3& axis) const override {
    return axis.cross(half_).norm() + radius_;
  }

  sim::Vec3 half_, axis_{0, 0, 1};
  double radius_, length_ = 0;
};

}  // namespace

SIM_PLUGIN(Collider, "capsule") {
  registrar.add(sim::Plugin<sim::Collider>{
      {.name = "capsule",
       .summary = "a rod with round ends, solid within, or a hollow one",
       .formula = "the distance from the line a .. b >= radius + thickness;  inside: <= radius - "
                  "thickness",
       .params = sim::solid_params(
           {{.name = "a",
             .type = sim::ParamType::kVector,
             .unit = "m",
             .doc = "one end of the line",
             .required = true},
            {.name = "b",
             .type = sim::ParamType::kVector,
             .unit = "m",
             .doc = "the other end; its center lies in the middle",
             .required = true},
            {.name = "radius", .unit = "m", .doc = "radius", .required = true, .min = 0}}),
       .example = {{"a", sim::Vec3(-1, 0, 0)}, {"b", sim::Vec3(1, 0, 0)}, {"radius", 0.5}}},
      [](const sim::Params& params) { return std::make_unique<Capsule>(params); }});
}
