// Elastic solids by finite elements.
#include "core/plugin/plugin.h"
#include "fem_forces.h"

namespace {

class Solid final : public sim::ContinuumForce {
 public:
  Solid(const sim::ConstitutiveLaw& law, const sim::Elements& elements)
      : cells_(law, elements.ids, elements.arity == 10 ? 10 : 4) {}

  void bind(const sim::ParticleView& initial) override { cells_.bind(initial); }
  void prepare(const sim::ParticleView& view, sim::ThreadPool& pool) override {
    cells_.prepare(view, pool);
  }
  void accumulate(const sim::ParticleView&, sim::Tile tile, sim::ForceSink sink) const override {
    cells_.add(tile, sink);
  }
  bool depends_on_velocity() const override { return false; }
  bool conservative() const override { return true; }
  double potential(const sim::ParticleView&, sim::Tile tile) const override {
    return cells_.potential(tile);
  }
  sim::CellQuality cell_quality(const sim::ParticleView& view) const override {
    return cells_.quality(view);
  }
  bool has_jacobian() const override { return true; }
  void jacobian(const sim::ParticleView& view, sim::JacobianSink& sink) const override {
    cells_.jacobian(view, sink);
  }
  bool couplings(std::vector<std::array<int, 2>>& pairs) const override {
    cells_.couplings(pairs);
    return true;
  }

 private:
  sim::FemForces cells_;
};

std::unique_ptr<sim::Force> make_solid(const sim::Params& params, const sim::Elements& elements) {
  using Model = sim::ConstitutiveLaw::Model;
  const std::string& name = params.text("model");
  const Model model = name == "stvk"        ? Model::kStVk
                      : name == "corotated" ? Model::kCorotated
                                            : Model::kNeoHookean;
  return std::make_unique<Solid>(
      sim::solid_law(model, params.number("young"), params.number("poisson")), elements);
}

}  // namespace

SIM_PLUGIN(Force, "fem/solid") {
  using sim::ParamType;
  registrar.add(sim::ForcePlugin{
      {.name = "fem",
       .summary = "an elastic body of tetrahedra, by finite elements",
       .formula =
           "U = sum of V psi(F), F = dx/dX in each cell, V its volume at the start;  f = -dU/dx\n"
           "stvk         psi = mu E:E + lambda/2 tr(E)^2,  E = (F^T F - 1)/2\n"
           "corotated    psi = mu |F - R|^2 + lambda/2 (R:F - 3)^2,  R the rotation nearest to F\n"
           "neo_hookean  psi = mu/2 (I - 3 - log((I + 1)/4)) - 3/4 mu (J - 1) + lambda/2 (J - "
           "1)^2\n"
           "             I = |F|^2, J = det F, mu and lambda scaled: small strains follow Hooke\n"
           "the particles start where the body is at rest. Cells of 4 particles are too stiff in\n"
           "bending, cells of 10 (order = 2) hardly; neo_hookean and corotated survive inversion",
       .source =
           "Smith, de Goes & Kim (2018), Stable neo-Hookean flesh simulation, ACM Trans. Graph. "
           "37, 12; McAdams et al. (2011), Efficient elasticity for character skinning, ACM Trans. "
           "Graph. 30, 37; quadratic cells: Zienkiewicz & Taylor, The Finite Element Method",
       .params =
           {{.name = "young", .unit = "Pa", .doc = "Young's modulus", .required = true, .min = 0},
            {.name = "poisson",
             .default_value = 0.3,
             .doc = "Poisson's ratio",
             .min = -0.99,
             .max = 0.4999},
            {.name = "model",
             .type = ParamType::kText,
             .default_value = std::string("neo_hookean"),
             .doc = "psi",
             .choices = {"neo_hookean", "corotated", "stvk"}},
            {.name = "density",
             .unit = "kg/m^3",
             .doc = "gives the particles of the cells their masses, which they then have from "
                    "here alone; if not given, they have those of the scene's particles",
             .min = 0}},
       .elements = {.arity = 4, .name = "tetrahedron", .cells = true},
       .element_bytes = 2000},
      [](const sim::Params& params, const sim::Elements& elements) {
        return make_solid(params, elements);
      }});
}
