// Wind: the force of moving air on a surface, or on particles that each have an area.
#include <optional>

#include "core/particles/elements/element_couplings.h"
#include "core/particles/elements/torn_faces.h"
#include "core/plugin/plugin.h"
#include "wind_forces.h"

namespace {

using sim::AirNow;
using sim::Mat3;
using sim::Vec3;

sim::Air::Breeze breeze_of(const sim::Params& params) {
  return {params.number("breeze"), params.number("tau"), params.number("length"),
          params.integer("seed")};
}

class Wind : public sim::Force {
 public:
  explicit Wind(const sim::Params& params)
      : air_(params.vector("velocity"), breeze_of(params)),
        linear_(params.text("law") == "linear") {}

  bool has_jacobian() const override { return true; }

 protected:
  // A coefficient, with the factor of the law.
  double factor(const sim::Params& params, const char* name) const {
    return linear_ ? params.number(name) : 0.5 * params.number("density") * params.number(name);
  }

  sim::Air air_;
  bool linear_;
};

class WindOnSurface final : public Wind {
 public:
  explicit WindOnSurface(const sim::Params& params)
      : Wind(params),
        surface_(params.surface("surface")),
        law_{linear_, factor(params, "cn"), factor(params, "ct")} {}

  void bind(const sim::ParticleView&) override { forces_.emplace(law_, air_, *surface_); }
  void prepare(const sim::ParticleView& view, sim::ThreadPool& pool) override {
    forces_->prepare(view, pool);
  }
  void accumulate(const sim::ParticleView&, sim::Tile tile, sim::ForceSink sink) const override {
    forces_->add(tile, sink);
  }
  std::unique_ptr<sim::ForceSweep> sweep() const override { return forces_->sweep(); }
  void tear(sim::TornPairs torn) override {
    torn_.assign(torn.begin(), torn.end());
    forces_->tear(torn);
  }

  void jacobian(const sim::ParticleView& view, sim::JacobianSink& sink) const override {
    const AirNow air = air_.at(view.t);
    for (const auto& ids : surface_->triangles()) {
      if (sim::torn_face(torn_, ids)) continue;
      std::array<Vec3, 3> x, v;
      for (std::size_t c = 0; c < 3; ++c) {
        x[c] = view.position(ids[c]);
        v[c] = view.velocity(ids[c]);
      }
      const sim::WindOnTriangle wind = wind_on_triangle(law_, air, x, v);
      for (const int i : ids)
        for (std::size_t c = 0; c < 3; ++c) {
          sink.position(i, ids[c], wind.by_position[c]);
          sink.velocity(i, ids[c], wind.by_velocity);
        }
    }
  }
  bool couplings(std::vector<std::array<int, 2>>& pairs) const override {
    sim::add_element_couplings(surface_->ids(), 3, pairs);
    return true;
  }

 private:
  std::shared_ptr<const sim::TriangleMesh> surface_;
  sim::WindLaw law_;
  std::optional<sim::WindForces> forces_;
  std::vector<std::array<int, 2>> torn_;
};

// F = c |w| w, c = rho/2 A cn, or F = c w, c = A cn, with w = velocity of the air - v.
class WindOnParticles final : public Wind {
 public:
  explicit WindOnParticles(const sim::Params& params)
      : Wind(params), c_(params.number("area") * factor(params, "cn")) {}

  void prepare(const sim::ParticleView& view, sim::ThreadPool&) override { now_ = air_.at(view.t); }
  void accumulate(const sim::ParticleView& p, sim::Tile tile, sim::ForceSink sink) const override {
    for (int i = tile.begin; i < tile.end; ++i) {
      const Vec3 w = now_.velocity(p.position(i)) - p.velocity(i);
      sink.add(i, (linear_ ? c_ : c_ * w.norm()) * w);
    }
  }

  void jacobian(const sim::ParticleView& p, sim::JacobianSink& sink) const override {
    const AirNow now = air_.at(p.t);
    for (int i = 0; i < p.n; ++i) {
      Mat3 slope = Mat3::Zero();
      const Vec3 w = now.velocity(p.position(i), &slope) - p.velocity(i);
      const double speed = w.norm();
      Mat3 by_w = (linear_ ? c_ : c_ * speed) * Mat3::Identity();
      if (!linear_ && speed > 0) by_w += c_ / speed * sim::outer(w, w);
      sink.position(i, i, by_w * slope);
      sink.velocity(i, i, -1.0 * by_w);
    }
  }
  bool couplings(std::vector<std::array<int, 2>>& /*pairs*/) const override { return true; }

 private:
  double c_;
  AirNow now_;
};

std::unique_ptr<sim::Force> make_wind(const sim::Params& params) {
  const bool surface = params.has("surface"), area = params.has("area");
  if (surface == area)
    throw sim::Error(sim::ErrorKind::kScene,
                     {"force 'wind'", "",
                      surface ? "it has a surface and an area a particle" : "it blows on nothing",
                      "give surface = sim.surface { grid = ... }, or area = A in m^2"});
  if (surface) return std::make_unique<WindOnSurface>(params);
  return std::make_unique<WindOnParticles>(params);
}

}  // namespace

SIM_PLUGIN(Force, "wind") {
  using sim::ParamType;
  registrar.add(sim::ForcePlugin{
      {.name = "wind",
       .summary = "wind with a breeze, on a surface or on particles",
       .formula =
           "w = velocity + breeze(t, x) - v: of the air, past a triangle of area A and normal n\n"
           "quadratic  F = density/2 A (cn |w.n| (w.n) n + ct |w_t| w_t),  w_t = w - (w.n) n\n"
           "linear     F = A (cn (w.n) n + ct w_t),  cn and ct in Pa s/m\n"
           "a third on each corner;  on particles F = density/2 area cn |w| w, or area cn w",
       .source = "Wejchert & Haumann (1991), Animation aerodynamics; Keckeisen, Kimmerle, "
                 "Thomaszewski & Wacker (2004), Modelling effects of wind fields in cloth "
                 "animations",
       .params = {{.name = "surface",
                   .type = ParamType::kSurface,
                   .doc = "what it blows on, from either side"},
                  {.name = "area",
                   .unit = "m^2",
                   .doc = "instead of a surface: what each particle shows the wind",
                   .min = 0},
                  {.name = "velocity",
                   .type = ParamType::kVector,
                   .default_value = Vec3(1, 0, 0),
                   .unit = "m/s",
                   .doc = "mean of the air"},
                  {.name = "breeze",
                   .default_value = 0.0,
                   .unit = "m/s",
                   .doc = "strength of the breeze on the mean, root mean square on each axis",
                   .min = 0},
                  {.name = "tau",
                   .default_value = 0.5,
                   .unit = "s",
                   .doc = "time in which the breeze changes",
                   .min = 1e-9},
                  {.name = "length",
                   .default_value = 0.5,
                   .unit = "m",
                   .doc = "length over which the breeze changes; 0: the same everywhere",
                   .min = 0},
                  {.name = "density",
                   .default_value = 1.2,
                   .unit = "kg/m^3",
                   .doc = "of the air",
                   .min = 0},
                  {.name = "cn",
                   .default_value = 1.2,
                   .doc = "coefficient of the force across the surface, or of a particle",
                   .min = 0},
                  {.name = "ct",
                   .default_value = 0.1,
                   .doc = "coefficient of the force along the surface",
                   .min = 0},
                  {.name = "law",
                   .type = ParamType::kText,
                   .default_value = std::string("quadratic"),
                   .doc = "how the force grows with w",
                   .choices = {"quadratic", "linear"}},
                  {.name = "seed",
                   .type = ParamType::kInteger,
                   .default_value = std::int64_t{1},
                   .doc = "of the breeze: the same seed, the same bits"}},
       .elements = sim::ElementKind{},
       .example = {{"area", 0.1}}},
      [](const sim::Params& params, const sim::Elements&) { return make_wind(params); }});
}
