// Hooke springs between pairs of particles, with a rest length.
#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/particles/bridges.h"
#include "core/particles/springs/dashpots.h"
#include "core/particles/springs/springs.h"
#include "core/plugin/plugin.h"

namespace {

// A spring of a force with breakable springs, as given at the start.
struct Tie {
  int a, b;
  double k, rest, c;  // N/m, m, N s/m
  double limit;       // m: it breaks when it is longer, of struts when it is shorter; or infinity
  std::ptrdiff_t dashpot;  // its number among those; -1: none
  bool broken = false;
};

class Spring final : public sim::Force, public sim::Breakable {
 public:
  Spring(const sim::Params& params, const sim::Elements& ties)
      : params_(params), ties_(ties), sense_(sense_of(params)) {
    breaks_ = ties.values.contains("break_strain") || ties.values.contains("break_force") ||
              params.has("break_strain") || params.has("break_force");
  }

  // Springs that bridge particles may have to go with a tear, whatever they bear.
  void expect_tears() override {
    breaks_ = breaks_ || std::ranges::any_of(ties_.grids, [](const sim::GridPairs& pairs) {
                return pairs.parts() > 1;
              });
  }

  void bind(const sim::ParticleView& initial) override {
    const sim::ElementValues stiffness(ties_, params_, "stiffness"), rest(ties_, params_, "rest");
    const auto each_spring = [&](const sim::Springs::Visit& visit) {
      ties_.for_each([&](const sim::Element& tie) {
        visit(tie.ids[0], tie.ids[1], stiffness(tie), rest_length(rest(tie), tie, initial));
      });
    };
    springs_.emplace(initial.n, each_spring, sense_, breaks_);
    const sim::ElementValues damping(ties_, params_, "damping");
    const auto each_dashpot = [&](const sim::Springs::Visit& visit) {
      ties_.for_each([&](const sim::Element& tie) {
        if (damping(tie) > 0)
          visit(tie.ids[0], tie.ids[1], damping(tie),
                sense_ == kBoth ? 0 : rest_length(rest(tie), tie, initial));
      });
    };
    bool damped = false;
    each_dashpot([&](int, int, double, double) { damped = true; });
    if (damped) dashpots_.emplace(initial.n, each_dashpot, sense_, breaks_);
    if (breaks_) take_limits(initial);
    ties_ = {};
  }

  // Only the damping of the springs is accumulated.
  bool accumulates() const override { return dashpots_.has_value(); }
  bool depends_on_velocity() const override { return dashpots_.has_value(); }
  void accumulate(const sim::ParticleView& view, sim::Tile tile,
                  sim::ForceSink sink) const override {
    if (dashpots_) dashpots_->accumulate(view, tile, sink);
  }
  bool has_jacobian() const override { return dashpots_.has_value(); }
  void jacobian(const sim::ParticleView& view, sim::JacobianSink& sink) const override {
    if (dashpots_) dashpots_->jacobian(view, sink);
  }
  bool couplings(std::vector<std::array<int, 2>>& pairs) const override {
    if (dashpots_) dashpots_->couplings(pairs);
    return true;
  }

  const sim::Springs* springs() const override { return &*springs_; }

  double potential(const sim::ParticleView& view, sim::Tile tile) const override {
    return springs_->potential(view, tile);
  }

  bool conservative() const override { return !dashpots_; }

  void links(int i, std::vector<sim::Link>& out) const override {
    springs_->at(i, [&](int to, double k, double rest) {
      out.push_back({family(), to, k, rest, sense_});
    });
  }

  sim::Breakable* breakable() override { return breaks_ ? this : nullptr; }
  int ties() const override { return static_cast<int>(breakable_.size()); }
  std::array<int, 2> ends(int tie) const override { return {at(tie).a, at(tie).b}; }

  double energy(const sim::ParticleView& view, int tie) const override {
    const Tie& spring = at(tie);
    const double stretch =
        sim::spring_stretch(sense_, view.position(spring.a) - view.position(spring.b), spring.rest);
    return 0.5 * spring.k * stretch * stretch;
  }

  // A spring breaks in tension, a strut in compression.
  void find_overloaded(const sim::ParticleView& view, std::span<const double> /*multipliers*/,
                       std::vector<int>& out) const override {
    const bool pushes = sense_ == sim::SpringSense::kCompression;
    for (std::size_t tie = 0; tie < breakable_.size(); ++tie) {
      const Tie& spring = breakable_[tie];
      if (spring.broken) continue;
      const double square = (view.position(spring.a) - view.position(spring.b)).squaredNorm();
      const double most = spring.limit * spring.limit;
      if (pushes ? square < most : square > most) out.push_back(static_cast<int>(tie));
    }
  }

  void find_bridges(sim::TornPairs torn, std::vector<int>& out) const override {
    bridges_.find(torn, out);
  }

  void set_broken(std::span<const int> broken) override {
    auto next = broken.begin();
    for (std::size_t tie = 0; tie < breakable_.size(); ++tie) {
      Tie& spring = breakable_[tie];
      const bool now = next != broken.end() && *next == static_cast<int>(tie);
      next += now;
      if (now == spring.broken) continue;
      spring.broken = now;
      springs_->set(tie, now ? 0 : spring.k, now ? 0 : spring.rest);
      if (spring.dashpot >= 0)
        dashpots_->set(static_cast<std::size_t>(spring.dashpot), now ? 0 : spring.c,
                       now || sense_ == kBoth ? 0 : spring.rest);
    }
  }

  std::vector<std::pair<std::string, long>> families() const override {
    return {{family(), springs_->count()}};
  }

 private:
  const std::string& family() const { return params_.text("family"); }

  const Tie& at(int tie) const { return breakable_[static_cast<std::size_t>(tie)]; }

  // The smaller of both limits: |d| = r (1 + break_strain), and |d| = r + break_force / k. Without
  // a rest length there is no strain.
  void take_limits(const sim::ParticleView& initial) {
    const sim::ElementValues stiffness(ties_, params_, "stiffness"), rest(ties_, params_, "rest"),
        damping(ties_, params_, "damping"), strain(ties_, params_, "break_strain"),
        force(ties_, params_, "break_force");
    const bool pushes = sense_ == sim::SpringSense::kCompression;
    std::ptrdiff_t dashpots = 0;
    ties_.for_each([&](const sim::Element& tie) {
      const double k = stiffness(tie), r = rest_length(rest(tie), tie, initial);
      double most = HUGE_VAL;  // change of length, m
      if (r > 0 && !std::isnan(strain(tie))) most = std::min(most, r * strain(tie));
      if (k > 0 && !std::isnan(force(tie))) most = std::min(most, force(tie) / k);
      bridges_.add(static_cast<int>(breakable_.size()), tie.ids[0], tie.ids[1], tie.parts);
      breakable_.push_back({tie.ids[0], tie.ids[1], k, r, damping(tie),
                            pushes ? std::max(0.0, r - most) : r + most,
                            damping(tie) > 0 ? dashpots++ : -1});
    });
  }

  static constexpr auto kBoth = sim::SpringSense::kBoth;

  static sim::SpringSense sense_of(const sim::Params& params) {
    return params.flag("tension_only")       ? sim::SpringSense::kTension
           : params.flag("compression_only") ? sim::SpringSense::kCompression
                                             : kBoth;
  }

  // The given rest length, else the distance in the grid or at the start.
  static double rest_length(double said, const sim::Element& tie,
                            const sim::ParticleView& initial) {
    if (!std::isnan(said)) return said;
    if (!std::isnan(tie.length)) return tie.length;
    return sim::length(initial.position(tie.ids[0]) - initial.position(tie.ids[1]));
  }

  sim::Params params_;
  sim::Elements ties_;
  std::optional<sim::Springs> springs_;
  std::optional<sim::Dashpots> dashpots_;  // if any spring is damped
  sim::SpringSense sense_;
  bool breaks_ = false;
  std::vector<Tie> breakable_;  // in the order of the scene
  sim::Bridges bridges_;
};

}  // namespace

SIM_PLUGIN(Force, "spring") {
  using sim::ParamType;
  registrar.add(sim::ForcePlugin{
      {.name = "spring",
       .summary = "Hooke springs between pairs of particles, damped if you like",
       .formula = "f_i = -k (|d| - r) d/|d|,  d = x_i - x_j;  0 for d = 0 and r > 0\n"
                  "potential energy 1/2 k (|d| - r)^2\n"
                  "damping c adds  -c ((v_i - v_j).d/|d|) d/|d|",
       .source = "Hooke (1678), De potentia restitutiva",
       .params = {{.name = "family",
                   .type = ParamType::kText,
                   .default_value = std::string("spring"),
                   .doc = "name under which these springs are listed"},
                  {.name = "stiffness",
                   .type = ParamType::kNumber,
                   .unit = "N/m",
                   .doc = "k",
                   .required = true,
                   .per_tie = true,
                   .min = 0},
                  {.name = "rest",
                   .type = ParamType::kNumber,
                   .unit = "m",
                   .doc = "rest length r; if not given, the distance in the grid or at the start",
                   .per_tie = true,
                   .min = 0},
                  {.name = "damping",
                   .default_value = 0.0,
                   .unit = "N s/m",
                   .doc = "c, along the spring; for a particle of m kg on one, 2 sqrt(k m) is "
                          "critical",
                   .per_tie = true,
                   .min = 0},
                  {.name = "tension_only",
                   .type = ParamType::kFlag,
                   .default_value = false,
                   .doc = "cables: neither force nor damping where |d| < r"},
                  {.name = "compression_only",
                   .type = ParamType::kFlag,
                   .default_value = false,
                   .doc = "struts that only push: neither force nor damping where |d| > r"},
                  {.name = "break_strain",
                   .doc = "|d| / r - 1 beyond which a spring breaks at the end of a step; of "
                          "struts 1 - |d| / r; if not given, none does",
                   .per_tie = true,
                   .min = 0},
                  {.name = "break_force",
                   .unit = "N",
                   .doc = "likewise k (|d| - r), without the damping",
                   .per_tie = true,
                   .min = 0}},
       .elements = {.arity = 2}},
      [](const sim::Params& params, const sim::Elements& ties) {
        if (params.flag("tension_only") && params.flag("compression_only"))
          throw sim::Error(sim::ErrorKind::kScene,
                           {"force 'spring'", "",
                            "tension_only and compression_only: it may neither pull nor push",
                            "leave out one of the two, or both"});
        return std::make_unique<Spring>(params, ties);
      }});
}
