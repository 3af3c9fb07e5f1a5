// Uniform gravity: f = m g, with the potential energy -m g.x (zero at the origin).
#include "core/plugin/plugin.h"
#include "core/simd/lanes.h"

namespace {

class Gravity final : public sim::Force {
 public:
  explicit Gravity(const sim::Vec3& g) : g_(g) {}

  std::optional<sim::AffineForce> affine() const override { return sim::AffineForce{g_, 0}; }

  double potential(const sim::ParticleView& p, sim::Tile tile) const override {
    const sim::Vec3 g = g_;
    return -sim::sum_in_lanes(tile.begin, tile.end, [&](int i) {
      return p.free_mass(i) * (g[0] * p.x[i] + g[1] * p.y[i] + g[2] * p.z[i]);
    });
  }

  bool conservative() const override { return true; }

 private:
  sim::Vec3 g_;
};

}  // namespace

SIM_PLUGIN(Force, "gravity") {
  registrar.add(sim::ForcePlugin{{.name = "gravity",
                                  .summary = "uniform gravity on every free particle",
                                  .formula = "f = m g,  potential energy -m g.x",
                                  .params = {{.name = "g",
                                              .type = sim::ParamType::kVector,
                                              .default_value = sim::Vec3(0, -9.81, 0),
                                              .unit = "m/s^2",
                                              .doc = "acceleration"}},
                                  .pointwise = true},
                                 [](const sim::Params& params, const sim::Elements&) {
                                   return std::make_unique<Gravity>(params.vector("g"));
                                 }});
}
