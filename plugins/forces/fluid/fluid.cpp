// A fluid of smoothed particles (SPH).
#include "fluid_correction.h"
#include "fluid_forces.h"
#include "fluid_projection.h"

#include <algorithm>

#include "core/particles/scene_names.h"
#include "core/plugin/plugin.h"

namespace {

class Fluid final : public sim::Force {
 public:
  // boundary: the names in the scene.
  Fluid(sim::FluidForces forces, std::unique_ptr<sim::FluidProjection> projection,
        std::vector<std::string> boundary)
      : forces_(std::move(forces)),
        projection_(std::move(projection)),
        boundary_(std::move(boundary)) {}

  void bind(const sim::ParticleView& initial) override {
    forces_.bind(initial);
    if (projection_) projection_->bind(forces_.law(), initial);
  }
  std::unique_ptr<sim::StepCorrection> correction(sim::Particles& particles) override {
    if (!projection_) return nullptr;
    return std::make_unique<sim::FluidCorrection>(*projection_, *this, particles);
  }
  // Internal variables: the pressures that warm-start the projection of the next step.
  int internal_size() const override { return projection_ ? projection_->count() : 0; }
  void start(std::span<double> memory) const override { std::ranges::fill(memory, 0.0); }
  void derive(const sim::ParticleView&, std::span<double> rate) const override {
    std::ranges::fill(rate, 0.0);
  }
  bool internal_depends_on_particles() const override { return false; }
  void prepare(const sim::ParticleView& view, sim::ThreadPool& pool) override {
    if (forces_.acts()) forces_.prepare(view, pool);
  }
  bool accumulates() const override { return forces_.acts(); }
  void accumulate(const sim::ParticleView&, sim::Tile tile, sim::ForceSink sink) const override {
    forces_.add_pressure(tile, sink);
    if (forces_.viscous()) forces_.add_viscosity(tile, sink);
  }
  double potential(const sim::ParticleView&, sim::Tile tile) const override {
    return forces_.acts() ? forces_.potential(tile) : 0;
  }

  // Moving walls do work; the work of a projection is booked by itself.
  bool driven() const { return forces_.walls_move() && !projection_; }
  bool conservative() const override { return !forces_.viscous() && !driven(); }
  bool has_dissipative_part() const override { return forces_.viscous() && !driven(); }
  void dissipative_part(const sim::ParticleView&, sim::Tile tile,
                        sim::ForceSink sink) const override {
    forces_.add_viscosity(tile, sink);
  }
  bool depends_on_velocity() const override { return forces_.viscous(); }

  // Notes name particles and colliders that the fluid passes through.
  std::vector<std::string> notes(const sim::SceneNames& names) const override {
    std::vector<std::string> notes;
    if (const std::string uncoupled_particles = names.particles(forces_.uncoupled_particles());
        !uncoupled_particles.empty())
      notes.push_back("does not see " + uncoupled_particles +
                      ": it flows through them; name their surface as its solid, and bodies as its "
                      "bodies");
    const auto open = std::ranges::find_if(boundary_, [&](const std::string& collider) {
      return std::ranges::find(names.colliders, collider) == names.colliders.end();
    });
    if (open != boundary_.end())
      notes.push_back(
          "has " + *open +
          " in its boundary, which is none of the scene's colliders: particles may pass "
          "it; name it in both");
    return notes;
  }

 private:
  sim::FluidForces forces_;
  std::unique_ptr<sim::FluidProjection> projection_;
  std::vector<std::string> boundary_;
};

// 0 if it is not given.
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
  const bool compressible = params.text("solver") == "wcsph";
  sim::FluidForces forces({params.number("density"), given(params, "smoothing"),
                           given(params, "speed_of_sound"), params.number("viscosity"),
                           params.number("alpha"), params.number("surface_tension"), compressible},
                          static_cast<int>(params.integer("dimensions")), ids);
  std::unique_ptr<sim::FluidProjection> projection;
  if (!compressible)
    projection = std::make_unique<sim::FluidProjection>(params.number("density_error"), ids);
  std::vector<std::string> boundary;
  if (params.has("boundary"))
    for (const auto& collider : params.colliders("boundary")) {
      forces.add_wall(collider->make());
      if (projection) projection->add_wall(collider->make());
      if (!collider->text.empty()) boundary.push_back(collider->text);
    }
  if (projection && (params.has("solid") || params.has("bodies")))
    throw sim::Error(sim::ErrorKind::kScene,
                     {"force 'fluid'", "", "solver 'dfsph' knows no solid and no bodies",
                      "leave solver out: 'wcsph' does"});
  if (params.has("solid")) forces.set_solid(params.surface("solid"));
  if (params.has("bodies"))
    for (const auto& body : params.bodies("bodies")) forces.add_body(body);
  return std::make_unique<Fluid>(std::move(forces), std::move(projection), std::move(boundary));
}

}  // namespace

SIM_PLUGIN(Force, "fluid") {
  using sim::ParamType;
  registrar.add(sim::ForcePlugin{
      {.name = "fluid",
       .summary = "a fluid of smoothed particles, weakly compressible or incompressible",
       .formula =
           "n_i = sum of w(r_ij/h) / that of a lattice,  w(q) = (1 - q/2)^4 (2 q + 1)\n"
           "U = sum of V e(n_i),  p = n^2 e' = density c^2/7 (n^7 - 1) for n > 1, else 0\n"
           "f_i = -dU/dx_i - mu K sum of (1 - q/2)^3 (v_ij.d)/(r^2 + h^2/100) d\n"
           "mu = viscosity + density alpha h c/(2 (dimensions + 2)),  V = mass/density,\n"
           "K: so that it is mu V v'' in a shear. surface_tension: A (9/8 u^4 - u^3) a pair,\n"
           "u = 1 - r/2h. Walls mirror the fluid: they have no friction, and are exact\n"
           "where they are plane and meet at right angles.\n"
           "Explicit steps of up to some 0.6 h/c are stable. Splashes are chaotic: runs\n"
           "with other steps part, as --verify shows. With dfsph pressures follow from\n"
           "n <= 1 and h dn/dt <= max(0, 1 - n) at the end of each step: no sound, steps\n"
           "as long as a particle goes some 0.3 of a spacing, of first order",
       .source = "Monaghan (1994), Simulating free surface flows with SPH, J. Comput. Phys. 110, "
                 "399-406; Monaghan (2005), Rep. Prog. Phys. 68, 1703-1759; kernel: Wendland "
                 "(1995), Adv. Comput. Math. 4, 389-396; dfsph: Bender & Koschier (2015), "
                 "Proc. SCA, 147-155",
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
             .doc = "how pressure follows: from the density alone, by Tait's equation, or so that "
                    "the density keeps to the one at rest; then speed_of_sound is that of alpha "
                    "alone, and there can be no solid and no bodies",
             .choices = {"wcsph", "dfsph"}},
            {.name = "density_error",
             .default_value = 1e-3,
             .doc = "with dfsph: what its particles may be denser than at rest, over that, in the "
                    "mean; ten times that for one of them",
             .min = 1e-8,
             .max = 0.1}},
       .elements = sim::ElementKind{.arity = 1},
       .example = {{"density", 0.1}, {"speed_of_sound", 3.0}}},
      [](const sim::Params& params, const sim::Elements& elements) {
        return make_fluid(params, elements);
      }});
}
