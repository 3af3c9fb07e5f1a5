// Penalty contact: a compliant solid, so that the motion stays an ordinary differential equation,
// for any integrator.
#include "core/math/elementary.h"
#include "core/plugin/plugin.h"

namespace {

using sim::Vec3;

// d^p, by products and a square root if p is a multiple of 1/2.
double power_of(double d, double p) {
  double result = 1;
  for (; p >= 1; p -= 1) result *= d;
  if (p == 0) return result;
  return result * (p == 0.5 ? std::sqrt(d) : sim::power(d, p));
}

class PenaltyContact final : public sim::Force {
 public:
  explicit PenaltyContact(const sim::Params& params)
      : collider_(params.collider("collider")->make()),
        stiffness_(params.number("stiffness")),
        power_(params.number("power")),
        damping_(params.number("damping")),
        friction_(params.number("friction")),
        slip_(params.number("slip")) {
    if (!(slip_ > 0))
      throw sim::Error(sim::ErrorKind::kScene,
                       {"force 'contact'", "", "its slip is 0", "give a velocity > 0 in m/s"});
    if (collider_->material().law)
      throw sim::Error(
          sim::ErrorKind::kScene,
          {"force 'contact'", "", "its collider has a law, and this force is a law of its own",
           "leave `law` out of the collider, or give the collider itself to the scene"});
    solids_ = collider_->sides();
    if (solids_.empty()) solids_.push_back(std::move(collider_));
  }

  void bind(const sim::ParticleView& initial) override {
    for (auto& solid : solids_) {
      solid->bind(initial);
      if (solid->sampled()) solid->prepare_interval(initial.t, initial.t);
    }
  }

  void prepare(const sim::ParticleView& view, sim::ThreadPool& /*team*/) override {
    for (auto& solid : solids_)
      if (solid->sampled()) solid->prepare_interval(view.t, view.t);
  }

  // Runs of particles that are surely outside are skipped.
  void accumulate(const sim::ParticleView& view, sim::Tile tile, sim::ForceSink f) const override {
    each(view, tile, [&](int i, const sim::SurfaceSample& sample) {
      const double depth = -sample.gap, elastic = power_of(depth, power_);
      const Vec3 relative =
          depends_on_velocity() ? Vec3(view.velocity(i) - sample.velocity) : Vec3(0, 0, 0);
      const double normal = relative.dot(sample.normal);
      const double push = elastic * std::max(0.0, stiffness_ - damping_ * normal);
      const Vec3 slip = relative - normal * sample.normal;
      f.add(i, push * sample.normal -
                   friction_ * push / std::sqrt(slip.squaredNorm() + slip_ * slip_) * slip);
    });
  }

  bool depends_on_velocity() const override { return damping_ > 0 || friction_ > 0; }

  double potential(const sim::ParticleView& view, sim::Tile tile) const override {
    double sum = 0;
    each(view, tile, [&](int, const sim::SurfaceSample& sample) {
      sum += stiffness_ / (power_ + 1) * power_of(-sample.gap, power_ + 1);
    });
    return sum;
  }
  bool conservative() const override {
    return !depends_on_velocity() &&
           std::ranges::none_of(solids_, [](const auto& solid) { return solid->moves(); });
  }

 private:
  // Calls act(i, sample) for every free particle of the tile that penetrates.
  template <class Act>
  void each(const sim::ParticleView& view, sim::Tile tile, const Act& act) const {
    constexpr int kRun = 32;
    for (const auto& solid : solids_)
      for (int begin = tile.begin; begin < tile.end; begin += kRun) {
        const int end = std::min(begin + kRun, tile.end);
        Vec3 least = view.position(begin), most = least;
        for (int i = begin; i < end; ++i)
          for (int axis = 0; axis < 3; ++axis) {
            const double x = axis == 0 ? view.x[i] : axis == 1 ? view.y[i] : view.z[i];
            least[axis] = std::min(least[axis], x);
            most[axis] = std::max(most[axis], x);
          }
        const Vec3 half = 0.5 * most - 0.5 * least;
        if (solid->clearance(view.t, Vec3(least + half), half) > 0) continue;
        for (int i = begin; i < end; ++i) {
          if (!view.free(i)) continue;
          const sim::SurfaceSample sample = solid->query(view.t, view.position(i));
          if (sample.gap < 0) act(i, sample);
        }
      }
  }

  std::unique_ptr<sim::Collider> collider_;
  std::vector<std::unique_ptr<sim::Collider>> solids_;
  double stiffness_, power_, damping_, friction_, slip_;
};

// The collider of the example: y >= 0.
class HalfSpace final : public sim::Collider {
 public:
  sim::ContactMaterial material() const override { return {}; }
  bool moves() const override { return false; }
  sim::SurfaceSample query(double, const Vec3& x) const override { return {.gap = x[1]}; }
};

}  // namespace

SIM_PLUGIN(Force, "contact") {
  registrar.add(sim::ForcePlugin{
      {.name = "contact",
       .summary = "a collider that gives way: contact as a force, for any integrator",
       .formula =
           "f = d^power max(0, stiffness - damping w.n) (n - friction w_t / sqrt(w_t^2 + slip^2))\n"
           "d: how deep inside;  w: velocity relative to the surface, w_t along it\n"
           "a Runge-Kutta method keeps the order power + 1: with power = 3 rk4 has its fourth",
       .source = "Hunt & Crossley (1975), J. Appl. Mech. 42(2) 440, eq. 7: the damping",
       .params = {{.name = "collider",
                   .type = sim::ParamType::kCollider,
                   .doc = "the solid, without a law; its friction and restitution do not count",
                   .required = true},
                  {.name = "stiffness",
                   .unit = "N/m^power",
                   .doc = "force at a depth of 1 m",
                   .required = true,
                   .min = 0},
                  {.name = "power",
                   .default_value = 3.0,
                   .doc = "1: a spring, 1.5: Hertz's spheres, 3: smooth enough for rk4",
                   .min = 1,
                   .max = 8},
                  {.name = "damping",
                   .default_value = 0.0,
                   .unit = "N s/m^(power+1)",
                   .doc = "of the velocity along the normal; takes energy from a bounce",
                   .min = 0},
                  {.name = "friction",
                   .default_value = 0.0,
                   .doc = "Coulomb's coefficient, at velocities well above `slip`",
                   .min = 0},
                  {.name = "slip",
                   .default_value = 0.01,
                   .unit = "m/s",
                   .doc = "velocity along the surface below which friction grows with it",
                   .min = 0}},
       .pointwise = true,
       .example = {{"collider",
                    std::make_shared<const sim::ColliderMaker>(sim::ColliderMaker{
                        [] { return std::make_unique<HalfSpace>(); }, "sim.collider.plane {}"})},
                   {"stiffness", 100.0}}},
      [](const sim::Params& p, const sim::Elements&) {
        return std::make_unique<PenaltyContact>(p);
      }});
}
