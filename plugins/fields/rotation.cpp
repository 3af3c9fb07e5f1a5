// Rigid rotation about the z axis: x' = omega (-y, x, 0).
#include "core/plugin/plugin.h"

namespace {

class Rotation final : public sim::Field {
 public:
  explicit Rotation(double omega) : omega_(omega) {}

  void bind(std::size_t /*size*/, int dimension) override {
    if (dimension != 3)
      throw sim::Error(sim::ErrorKind::kScene,
                       {"field 'rotation'", "", "it moves points of space, not a flat state",
                        "write state = { x = { {1, 0, 0} } }"});
  }

  void eval(double /*t*/, std::span<const double> x, std::span<double> dxdt) const override {
    for (std::size_t i = 0; i < x.size(); i += 3) {
      dxdt[i] = -omega_ * x[i + 1];
      dxdt[i + 1] = omega_ * x[i];
      dxdt[i + 2] = 0;
    }
  }

 private:
  double omega_;
};

}  // namespace

SIM_PLUGIN(Field, "rotation") {
  registrar.add(
      sim::FieldPlugin{{.name = "rotation",
                        .summary = "rigid rotation about the z axis; the exact orbit is a circle",
                        .formula = "x' = omega (-y, x, 0)",
                        .params = {{.name = "omega",
                                    .type = sim::ParamType::kNumber,
                                    .default_value = 1.0,
                                    .unit = "rad/s",
                                    .doc = "angular velocity"}}},
                       [](const sim::Params& params) {
                         return std::make_unique<Rotation>(params.number("omega"));
                       }});
}
