// A force on each particle that a scene writes as a Lua function.
#include <algorithm>
#include <numeric>
#include <vector>

#include "core/plugin/plugin.h"

namespace {

// Lua runs on one thread: all particles are evaluated before the tiles.
class LuaForce final : public sim::Force {
 public:
  explicit LuaForce(const sim::Params& params)
      : f_(params.particle_function("f")), reads_velocity_(params.flag("reads_velocity")) {
    if (params.has("potential")) potential_ = params.particle_function("potential");
  }

  void bind(const sim::ParticleView& initial) override {
    ids_.resize(static_cast<std::size_t>(initial.n));
    std::iota(ids_.begin(), ids_.end(), 0);
    forces_.resize(3 * ids_.size());
  }

  void prepare(const sim::ParticleView& view, sim::ThreadPool& /*team*/) override {
    f_(reads_velocity_ ? view : without_velocities(view), ids_, forces_);
  }

  void accumulate(const sim::ParticleView&, sim::Tile tile, sim::ForceSink sink) const override {
    for (int i = tile.begin; i < tile.end; ++i) {
      const double* const f = forces_.data() + 3 * i;
      sink.add(i, {f[0], f[1], f[2]});
    }
  }

  bool depends_on_velocity() const override { return reads_velocity_; }

  double potential(const sim::ParticleView& view, sim::Tile tile) const override {
    if (!potential_) return 0;
    std::vector<int> ids;
    for (int i = tile.begin; i < tile.end; ++i)
      if (view.free(i)) ids.push_back(i);
    std::vector<double> energies(ids.size());
    potential_(without_velocities(view), ids, energies);
    return std::accumulate(energies.begin(), energies.end(), 0.0);
  }

 private:
  static sim::ParticleView without_velocities(sim::ParticleView view) {
    view.vx = view.vy = view.vz = nullptr;
    return view;
  }

  sim::ParticleFunction f_, potential_;
  bool reads_velocity_;
  std::vector<int> ids_;        // all of them
  std::vector<double> forces_;  // N, three a particle
};

}  // namespace

SIM_PLUGIN(Force, "lua") {
  using sim::ParamType;
  registrar.add(sim::ForcePlugin{
      {.name = "lua",
       .summary = "a force on each particle, written in Lua",
       .formula = "f_i = f(t, i, x_i, v_i)",
       .params =
           {{.name = "f",
             .type = ParamType::kParticleFunction,
             .unit = "N",
             .doc = "function(t, i, x, v) that returns fx, fy, fz on particle i at x = {x, y, z} "
                    "with velocity v; it must depend on nothing else, and not keep the tables",
             .required = true,
             .positional = true},
            {.name = "potential",
             .type = ParamType::kParticleFunction,
             .unit = "J",
             .doc = "function(t, i, x) that returns its potential energy; if not given, none"},
            {.name = "reads_velocity",
             .type = ParamType::kFlag,
             .default_value = true,
             .doc = "false: f gets no v, and verlet and its like take the force"}},
       .pointwise = true},
      [](const sim::Params& params, const sim::Elements&) {
        return std::make_unique<LuaForce>(params);
      }});
}
