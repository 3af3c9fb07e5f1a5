// A fluid of smoothed particles.
#include "core/particles/fluid/fluid_forces.h"

#include <algorithm>

#include "core/plugin/plugin.h"

namespace {

class Fluid final : public sim::Force {
 public:
  explicit Fluid(sim::FluidForces forces) : forces_(std::move(forces)) {}

  void bind(const sim::ParticleView& initial) override { forces_.bind(initial); }
  void prepare(const sim::ParticleView& view, sim::Team& team) override {
    forces_.prepare(view, team);
  }
  void accumulate(const sim::ParticleView&, sim::Tile tile, sim::ForceSink sink) const override {
    forces_.add_pressure(tile, sink);
    if (forces_.viscous()) forces_.add_viscosity(tile, sink);
  }
  double potential(const sim::ParticleView&, sim::Tile tile) const override {
    return forces_.potential(tile);
  }

  // Walls that move do work.
  bool conservative() const override { return !forces_.viscous() && !forces_.walls_move(); }
  bool resists() const override { return forces_.viscous() && !forces_.walls_move(); }
  void resist(const sim::ParticleView&, sim::Tile tile, sim::ForceSink sink) const override {
    forces_.add_viscosity(tile, sink);
  }
  bool depends_on_velocity() const override { return forces_.viscous(); }

  std::pair<std::vector<int>, std::string> unseen() const override {
    return {forces_.unseen(), "name their surface as its solid, and bodies as its bodies"};
  }

 private:
  sim::FluidForces forces_;
};

// 0 where it is not given.
double given(const sim::Params& params, const char* name) {
  if (!params.has(name)) return 0;
  if (!(params.number(name) > 0))
    throw sim::Error(sim::ErrorKind::kScene,
                     {"force 'fluid'", "", std::string("its ") + name + " is 0",
                      "give a positive number, or leave it out"});
  return params.number(name);
}

std::unique_ptr<sim::Force> make_fluid(const sim::Params& params, const sim::Elements& elements) {
  std::vector<int> ids = elements.ids;
  std::ranges::sort(ids);
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  sim::FluidForces forces(
      {params.number("density"), given(params, "smoothing"), given(params, "speed_of_sound"),
       params.number("viscosity"), params.number("alpha"), params.number("surface_tension")},
      static_cast<int>(params.integer("dimensions")), std::move(ids));
  if (params.has("boundary"))
    for (const auto& collider : params.colliders("boundary")) forces.add_wall(collider->make());
  if (params.has("solid")) forces.set_solid(params.surface("solid"));
  if (params.has("bodies"))
    for (const auto& body : params.bodies("bodies")) forces.add_body(body);
  return std::make_unique<Fluid>(std::move(forces));
}

}  // namespace

SIM_PLUGIN(Force, "fluid") {
  using sim::ParamType;
  registrar.add(sim::ForcePlugin{
      {.name = "fluid",
       .summary = "a fluid of smoothed particles, weakly compressible",
       .formula =
           "n_i = sum of w(r_ij/h) / that of a lattice,  w(q) = (1 - q/2)^4 (2 q + 1)\n"
           "U = sum of V e(n_i),  p = n^2 e' = density c^2/7 (n^7 - 1) for n > 1, else 0\n"
           "f_i = -dU/dx_i - mu K sum of (1 - q/2)^3 (v_ij.d)/(r^2 + h^2/100) d\n"
           "mu = viscosity + density alpha h c/(2 (dimensions + 2)),  V = mass/density,\n"
           "K: so that it is mu V v'' in a shear. surface_tension: A (9/8 u^4 - u^3) a pair,\n"
           "u = 1 - r/2h. Walls mirror the fluid: they have no friction, and are exact\n"
           "where they are plane and meet at right angles.\n"
           "Explicit steps of up to some 0.6 h/c are stable. Splashes are chaotic: runs\n"
           "with other steps part, as --verify shows",
       .source = "Monaghan (1994), Simulating free surface flows with SPH, J. Comput. Phys. 110, "
                 "399-406; Monaghan (2005), Rep. Prog. Phys. 68, 1703-1759; kernel: Wendland "
                 "(1995), Adv. Comput. Math. 4, 389-396",
       .params =
           {{.name = "density",
             .default_value = 1000.0,
             .unit = "kg/m^3",
             .doc = "at rest; a particle of mass m takes m/density",
             .min = 1e-6,
             .max = 1e6},
            {.name = "smoothing",
             .unit = "m",
             .doc = "h, half of the kernel's reach; if not given, 1.5 times the distance of "
                    "neighbours at rest",
             .min = 0},
            {.name = "speed_of_sound",
             .unit = "m/s",
             .doc = "c; if not given, ten times the speed of a fall over the largest extent of the "
                    "fluid at the start, which keeps the density within about 1 %",
             .min = 0},
            {.name = "viscosity",
             .default_value = 0.001,
             .unit = "Pa s",
             .doc = "of the fluid; water has 0.001",
             .min = 0},
            {.name = "alpha",
             .default_value = 0.05,
             .doc = "viscosity that the method needs beside: Monaghan's number",
             .min = 0,
             .max = 2},
            {.name = "surface_tension",
             .default_value = 0.0,
             .unit = "N/m",
             .doc = "of its free surface, by attraction between neighbours; water has 0.073",
             .min = 0},
            {.name = "boundary",
             .type = ParamType::kColliders,
             .doc =
                 "colliders of the scene that hold it: it goes on behind them as a mirror image; "
                 "the "
                 "mirrors lie a quarter of a spacing behind what particles touch: a thickness of "
                 "that much puts them into the surface"},
            {.name = "solid",
             .type = ParamType::kSurface,
             .doc = "the surface of what swims in it or lies in its way, a mesh as wide as the "
                    "distance of neighbours: each pushes the other, without friction. The fluid "
                    "feels a surface 0.84 of that distance outside of the mesh"},
            {.name = "bodies",
             .type = ParamType::kBodies,
             .doc = "rigid bodies of the scene that swim in it or lie in its way, thicker than 1.7 "
                    "times the distance of neighbours: each pushes the other, without friction"},
            {.name = "dimensions",
             .type = ParamType::kInteger,
             .default_value = std::int64_t{3},
             .doc = "2: particles in a plane, for 1 m of depth",
             .min = 2,
             .max = 3},
            {.name = "solver",
             .type = ParamType::kText,
             .default_value = std::string("wcsph"),
             .doc = "how pressure follows: from the density alone, by Tait's equation",
             .choices = {"wcsph"}}},
       .elements = sim::ElementKind{.arity = 1},
       .example = {{"density", 0.1}, {"speed_of_sound", 3.0}}},
      [](const sim::Params& params, const sim::Elements& elements) {
        return make_fluid(params, elements);
      }});
}
