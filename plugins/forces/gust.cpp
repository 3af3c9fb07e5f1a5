// A gusty wind: air that follows a breeze with a lag and drags every free particle along.
#include <cmath>

#include "core/base/hash.h"
#include "core/plugin/plugin.h"

namespace {

// A smooth random function of time with mean 0 and mean square 1, four times continuously
// differentiable so that methods of that order keep it: quintic B-splines over hashed coefficients,
//   b(t) = sum_k c_k B(t / spacing - k),  |b| <= sqrt(3 / B11(0)) = 2.76
// The c_k are uniform; the mean square of b is theirs times the integral of B^2, which is B11(0),
// the middle of the spline of degree 11. De Boor, A Practical Guide to Splines (1978).
class Breeze {
 public:
  Breeze(std::int64_t seed, int axis, double spacing)
      : seed_(static_cast<std::uint64_t>(seed)),
        axis_(static_cast<std::uint64_t>(axis)),
        spacing_(spacing) {}

  double at(double t) const {
    const double place = t / spacing_, knot = std::floor(place), u = place - knot;
    const double u2 = u * u, u3 = u2 * u, u4 = u2 * u2, u5 = u4 * u;
    const double r = 1 - u;
    const double weights[] = {r * r * r * r * r,
                              26 - 50 * u + 20 * u2 + 20 * u3 - 20 * u4 + 5 * u5,
                              66 - 60 * u2 + 30 * u4 - 10 * u5,
                              26 + 50 * u + 20 * u2 - 20 * u3 - 20 * u4 + 10 * u5,
                              1 + 5 * u + 10 * u2 + 10 * u3 + 5 * u4 - 5 * u5,
                              u5};
    double sum = 0;
    for (int j = 0; j < 6; ++j)
      sum += weights[j] * coefficient(static_cast<std::int64_t>(knot) + j);
    return sum / 120;
  }

 private:
  // Uniform between -1 and 1, times what makes the mean square of the sum 1.
  double coefficient(std::int64_t k) const {
    constexpr double kB11 = 655177.0 / 1663200.0;
    sim::StateHash hash;
    for (const std::uint64_t word : {seed_, axis_, static_cast<std::uint64_t>(k)}) hash.add(word);
    const double uniform = static_cast<double>(hash.value() >> 11) * 0x1p-52 - 1;
    return uniform * std::sqrt(3 / kB11);
  }

  std::uint64_t seed_, axis_;
  double spacing_;
};

// The velocity w of the air is a part of the state, three numbers. -c v is left to the system,
// which folds it; c w is what is accumulated.
class Gust final : public sim::Force {
 public:
  explicit Gust(const sim::Params& params)
      : mean_(params.vector("velocity")),
        strength_(params.number("breeze")),
        tau_(params.number("tau")),
        c_(params.number("c")),
        breeze_{{params.integer("seed"), 0, tau_},
                {params.integer("seed"), 1, tau_},
                {params.integer("seed"), 2, tau_}} {}

  std::optional<sim::AffineForce> affine() const override {
    return sim::AffineForce{sim::Vec3::Zero(), c_};
  }

  void accumulate(const sim::ParticleView& p, sim::Tile tile, sim::ForceSink f) const override {
    const sim::Vec3 push = c_ * sim::Vec3(p.memory[0], p.memory[1], p.memory[2]);
    for (int i = tile.begin; i < tile.end; ++i) f.add(i, push);
  }
  bool depends_on_velocity() const override { return false; }
  bool has_jacobian() const override { return true; }  // c w depends on no particle

  int memory_size() const override { return 3; }
  void start(std::span<double> w) const override {
    for (int axis = 0; axis < 3; ++axis) w[static_cast<std::size_t>(axis)] = mean_[axis];
  }
  void derive(const sim::ParticleView& p, std::span<double> rate) const override {
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      rate[i] = (mean_[axis] + strength_ * breeze_[axis].at(p.t) - p.memory[i]) / tau_;
    }
  }
  bool remembers_particles() const override { return false; }

 private:
  sim::Vec3 mean_;
  double strength_, tau_, c_;
  Breeze breeze_[3];
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
