// A plane: everything behind it is solid.
#include "core/plugin/plugin.h"

namespace {

class Plane final : public sim::Collider {
 public:
  explicit Plane(const sim::Params& params)
      : normal_(params.vector("normal")), surface_{params.number("restitution")} {
    const double length = normal_.stableNorm();
    if (!(length > 0))
      throw sim::Error(sim::ErrorKind::kScene, {"collider 'plane'", "", "its normal has no length",
                                                "give a direction, {0, 1, 0}"});
    normal_ /= length;
    // gap = n.(x - point) - thickness
    offset_ = normal_.dot(params.vector("point")) + params.number("thickness");
  }

  sim::Surface surface() const override { return surface_; }

  sim::Solid solid(double /*t*/) const override {
    return sim::plane_solid(offset_ * normal_, normal_);
  }

  sim::Touch touch(double /*t*/, const sim::Vec3& x) const override {
    return {.gap = normal_.dot(x) - offset_, .normal = normal_};
  }

  void near(double /*t*/, const sim::ParticleView& view, sim::Tile tile, double margin,
            std::uint8_t* near) const override {
    const double nx = normal_[0], ny = normal_[1], nz = normal_[2], least = offset_ + margin;
    for (int i = tile.begin; i < tile.end; ++i)
      near[i - tile.begin] |= nx * view.x[i] + ny * view.y[i] + nz * view.z[i] < least;
  }

 private:
  sim::Vec3 normal_;
  double offset_ = 0;
  sim::Surface surface_;
};

}  // namespace

SIM_PLUGIN(Collider, "plane") {
  registrar.add(sim::Plugin<sim::Collider>{
      {.name = "plane",
       .summary = "a plane without friction; everything behind it is solid",
       .formula = "n.(x - point) >= thickness\n"
                  "a touch at the velocity v: v := v - (1 + restitution) (n.v) n where n.v < 0",
       .params = {{.name = "point",
                   .type = sim::ParamType::kVector,
                   .default_value = sim::Vec3(0, 0, 0),
                   .unit = "m",
                   .doc = "a point of the plane"},
                  {.name = "normal",
                   .type = sim::ParamType::kVector,
                   .default_value = sim::Vec3(0, 1, 0),
                   .doc = "points away from what is solid; of any length but 0"},
                  {.name = "restitution",
                   .default_value = 0.0,
                   .doc = "share of the normal velocity that a bounce gives back",
                   .min = 0,
                   .max = 1},
                  {.name = "thickness",
                   .default_value = 0.0,
                   .unit = "m",
                   .doc = "how far in front of the plane particles are held",
                   .min = 0}}},
      [](const sim::Params& params) { return std::make_unique<Plane>(params); }});
}
