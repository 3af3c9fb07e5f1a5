// A gusty wind: air that follows a breeze with a lag and drags every free particle along.
#include "core/math/random_spline.h"
#include "core/plugin/plugin.h"

namespace {

// The velocity w of the air is a part of the state, three numbers. -c v is affine and left to the
// system; c w is accumulated.
class Gust final : public sim::Force {
 public:
  explicit Gust(const sim::Params& params)
      : mean_(params.vector("velocity")),
        strength_(params.number("breeze")),
        tau_(params.number("tau")),
        c_(params.number("c")),
        breeze_{{seed_of(params), 0}, {seed_of(params), 1}, {seed_of(params), 2}} {}

  std::optional<sim::AffineForce> affine() const override {
    return sim::AffineForce{sim::Vec3::Zero(), c_};
  }

  void accumulate(const sim::ParticleView& p, sim::Tile tile, sim::ForceSink f) const override {
    const sim::Vec3 push = c_ * sim::Vec3(p.internal[0], p.internal[1], p.internal[2]);
    for (int i = tile.begin; i < tile.end; ++i) f.add(i, push);
  }
  bool depends_on_velocity() const override { return false; }
  bool has_jacobian() const override { return true; }  // c w depends on no particle
  bool couplings(std::vector<std::array<int, 2>>& /*pairs*/) const override { return true; }

  int internal_size() const override { return 3; }
  void start(std::span<double> w) const override {
    for (int axis = 0; axis < 3; ++axis) w[static_cast<std::size_t>(axis)] = mean_[axis];
  }
  void derive(const sim::ParticleView& p, std::span<double> rate) const override {
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      rate[i] = (mean_[axis] + strength_ * breeze_[axis].at(p.t / tau_) - p.internal[i]) / tau_;
    }
  }
  bool internal_depends_on_particles() const override { return false; }

 private:
  static std::uint64_t seed_of(const sim::Params& params) {
    return static_cast<std::uint64_t>(params.integer("seed"));
  }

  sim::Vec3 mean_;
  double strength_, tau_, c_;
  sim::RandomSpline breeze_[3];
};

}  // namespace

SIM_PLUGIN(Force, "gust") {
  registrar.add(sim::ForcePlugin{
      {.name = "gust",
       .summary =
           "gusty wind: drags every free particle along with air that has a state of its own",
       .formula = "f = c (w - v),  w' = (velocity + breeze b(t) - w) / tau\n"
                  "b: smooth, random, mean square 1 on each axis, |b| <= 2.76",
       .params = {{.name = "velocity",
                   .type = sim::ParamType::kVector,
                   .default_value = sim::Vec3(1, 0, 0),
                   .unit = "m/s",
                   .doc = "mean of the air, and its velocity at the start"},
                  {.name = "breeze",
                   .default_value = 0.5,
                   .unit = "m/s",
                   .doc = "strength of the gusts, root mean square on each axis",
                   .min = 0},
                  {.name = "tau",
                   .default_value = 0.5,
                   .unit = "s",
                   .doc = "lag of the air, and the time in which b changes",
                   .min = 1e-9},
                  {.name = "c",
                   .unit = "kg/s",
                   .doc = "drag coefficient of a particle",
                   .required = true,
                   .min = 0},
                  {.name = "seed",
                   .type = sim::ParamType::kInteger,
                   .default_value = std::int64_t{1},
                   .doc = "of the gusts: the same seed, the same bits"}},
       .pointwise = true},
      [](const sim::Params& params, const sim::Elements&) {
        return std::make_unique<Gust>(params);
      }});
}
