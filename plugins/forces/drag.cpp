// Linear drag: f = -k v on every free particle.
#include "core/plugin/plugin.h"

namespace {

class Drag final : public sim::Force {
 public:
  explicit Drag(double k) : k_(k) {}

  std::optional<sim::AffineForce> affine() const override {
    return sim::AffineForce{sim::Vec3::Zero(), k_};
  }

 private:
  double k_;
};

}  // namespace

SIM_PLUGIN(Force, "drag") {
  registrar.add(sim::ForcePlugin{{.name = "drag",
                                  .summary = "linear drag on every free particle",
                                  .formula = "f = -k v",
                                  .params = {{.name = "k",
                                              .type = sim::ParamType::kNumber,
                                              .unit = "kg/s",
                                              .doc = "drag coefficient",
                                              .required = true,
                                              .min = 0}},
                                  .pointwise = true},
                                 [](const sim::Params& params, const sim::Elements&) {
                                   return std::make_unique<Drag>(params.number("k"));
                                 }});
}
