// A box, solid within, or a room.
#include "core/math/elementary.h"
#include "core/plugin/plugin.h"
#include "core/plugin/sdf_collider.h"

namespace {

using sim::Vec3;

// The three edges of a box that is rotated by |turn| rad about `turn`.
std::array<Vec3, 3> turned_axes(const Vec3& turn) {
  sim::Pose pose;
  if (const double angle = turn.norm(); angle > 0) {
    const auto [sine, cosine] = sim::sine_cosine(angle * 0.15915494309189533577);
    pose.axis = turn / angle;
    pose.sine = sine;
    pose.cosine = cosine;
  }
  return {pose.turned({1, 0, 0}), pose.turned({0, 1, 0}), pose.turned({0, 0, 1})};
}

// One wall of a room: a plane at a distance from its center.
class Wall final : public sim::SdfCollider {
 public:
  Wall(const sim::Params& params, const Vec3& inward, double distance, double radius)
      : SdfCollider(params, params.vector("center")),
        inward_(inward),
        distance_(distance),
        radius_(radius) {
    fill_outside();
  }

 private:
  Distance distance(const Vec3& x) const override { return {inward_.dot(x) + distance_, inward_}; }
  sim::PrimitiveSurface plain_form() const override {
    return {.form = sim::PrimitiveSurface::Form::kPlane, .normal = inward_, .radius = -distance_};
  }
  double least(const Vec3& middle, const Vec3& half) const override {
    double gap = distance(middle).gap;
    for (std::size_t axis = 0; axis < 3; ++axis) gap -= std::fabs(inward_[axis]) * half[axis];
    return gap;
  }
  double turning_radius(const Vec3&) const override { return radius_; }
  sim::RenderShape form() const override { return {}; }  // the room is drawn as a whole

  Vec3 inward_;
  double distance_, radius_;
};

class Box final : public sim::SdfCollider {
 public:
  explicit Box(const sim::Params& params)
      : SdfCollider(params, params.vector("center")),
        half_(params.vector("half")),
        axes_(turned_axes(params.vector("turn"))),
        turned_(params.vector("turn").norm() > 0) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (!(half_[axis] > 0))
        throw sim::Error(sim::ErrorKind::kScene,
                         {"collider 'box'", "", "a side of it has no length",
                          "give half = {x, y, z}, three numbers > 0 in m"});
    if (!inside()) return;
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const double sign : {-1.0, 1.0})
        walls_.push_back(
            std::make_unique<Wall>(params, sign * axes_[axis], half_[axis], half_.norm()));
  }

  std::vector<std::unique_ptr<Collider>> sides() override { return std::move(walls_); }

 private:
  sim::RenderShape form() const override {
    sim::RenderShape shape{.form = sim::RenderShape::Form::kBox};
    for (std::size_t axis = 0; axis < 3; ++axis)
      shape.axes[axis] = half_[static_cast<int>(axis)] * axes_[axis];
    return shape;
  }

  // The distance from the nearest point of the box; inside, to the nearest side, the first of
  // several.
  Distance distance(const Vec3& x) const override {
    Vec3 local, out{0, 0, 0};
    std::size_t nearest = 0;
    double depth = -HUGE_VAL;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      local[axis] = axes_[axis].dot(x);
      const double beyond = std::fabs(local[axis]) - half_[axis];
      out[axis] = std::max(0.0, beyond);
      if (beyond <= depth) continue;
      depth = beyond;
      nearest = axis;
    }
    const double gap = out.norm();
    if (!(gap > 0)) {
      const Vec3& side = axes_[nearest];
      return {depth, local[nearest] < 0 ? Vec3(-side) : side};
    }
    Vec3 normal{0, 0, 0};
    for (std::size_t axis = 0; axis < 3; ++axis)
      normal += std::copysign(out[axis] / gap, local[axis]) * axes_[axis];
    return {gap, normal};
  }

  double least(const Vec3& middle, const Vec3& half) const override {
    if (turned_) return SdfCollider::least(middle, half);
    Vec3 out;
    for (std::size_t axis = 0; axis < 3; ++axis)
      out[axis] = std::max(0.0, std::fabs(middle[axis]) - half[axis] - half_[axis]);
    const double gap = out.norm();
    return gap > 0 ? gap : SdfCollider::least(middle, half);
  }

  double turning_radius(const Vec3&) const override { return half_.norm(); }

  Vec3 half_;
  std::array<Vec3, 3> axes_;
  bool turned_;
  std::vector<std::unique_ptr<Collider>> walls_;
};

}  // namespace

SIM_PLUGIN(Collider, "box") {
  registrar.add(sim::Plugin<sim::Collider>{
      {.name = "box",
       .summary = "a solid box, or a room",
       .formula =
           "the distance from the box >= thickness, its edges rounded by that;  inside: that "
           "from each wall",
       .params = sim::solid_params({{.name = "half",
                                     .type = sim::ParamType::kVector,
                                     .unit = "m",
                                     .doc = "half of its sides",
                                     .required = true},
                                    {.name = "center",
                                     .type = sim::ParamType::kVector,
                                     .default_value = Vec3(0, 0, 0),
                                     .unit = "m",
                                     .doc = "where it is at rest"},
                                    {.name = "turn",
                                     .type = sim::ParamType::kVector,
                                     .default_value = Vec3(0, 0, 0),
                                     .unit = "rad",
                                     .doc = "turned about this axis by its length"}})},
      [](const sim::Params& params) { return std::make_unique<Box>(params); }});
}
