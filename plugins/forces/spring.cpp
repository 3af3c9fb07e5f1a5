// Hooke springs between pairs of particles, with a rest length.
#include <cmath>

#include "core/particles/springs/dashpots.h"
#include "core/particles/springs/springs.h"
#include "core/plugin/plugin.h"

namespace {

class Spring final : public sim::Force {
 public:
  Spring(const sim::Params& params, const sim::Elements& ties) : params_(params), ties_(ties) {}

  void bind(const sim::ParticleView& initial) override {
    const sim::ElementValues stiffness(ties_, params_, "stiffness"), rest(ties_, params_, "rest");
    springs_.emplace(initial.n, [&](const sim::Springs::Visit& visit) {
      ties_.for_each([&](const sim::Element& tie) {
        visit(tie.ids[0], tie.ids[1], stiffness(tie), rest_length(rest(tie), tie, initial));
      });
    });
    const sim::ElementValues damping(ties_, params_, "damping");
    const auto each_dashpot = [&](const sim::Springs::Visit& visit) {
      ties_.for_each([&](const sim::Element& tie) {
        if (damping(tie) > 0) visit(tie.ids[0], tie.ids[1], damping(tie), 0);
      });
    };
    bool damped = false;
    each_dashpot([&](int, int, double, double) { damped = true; });
    if (damped) dashpots_.emplace(initial.n, each_dashpot);
    ties_ = {};
  }

  // Beside the springs: their damping.
  bool accumulates() const override { return dashpots_.has_value(); }
  bool depends_on_velocity() const override { return dashpots_.has_value(); }
  void accumulate(const sim::ParticleView& view, sim::Tile tile,
                  sim::ForceSink sink) const override {
    if (dashpots_) dashpots_->accumulate(view, tile, sink);
  }
  bool has_jacobian() const override { return dashpots_.has_value(); }
  void jacobian(const sim::ParticleView& view, sim::BlockSink& sink) const override {
    if (dashpots_) dashpots_->jacobian(view, sink);
  }

  const sim::Springs* springs() const override { return &*springs_; }

  double potential(const sim::ParticleView& view, sim::Tile tile) const override {
    return springs_->potential(view, tile);
  }

  bool conservative() const override { return !dashpots_; }

  void links(int i, std::vector<sim::Link>& out) const override {
    springs_->at(i, [&](int to, double k, double rest) { out.push_back({family(), to, k, rest}); });
  }

  std::vector<std::pair<std::string, long>> families() const override {
    return {{family(), springs_->count()}};
  }

 private:
  const std::string& family() const { return params_.text("family"); }

  // What is said, else the distance in the grid or at the start.
  static double rest_length(double said, const sim::Element& tie,
                            const sim::ParticleView& initial) {
    if (!std::isnan(said)) return said;
    if (!std::isnan(tie.length)) return tie.length;
    return sim::length(initial.position(tie.ids[0]) - initial.position(tie.ids[1]));
  }

  sim::Params params_;
  sim::Elements ties_;
  std::optional<sim::Springs> springs_;
  std::optional<sim::Dashpots> dashpots_;  // where any spring is damped
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
                   .min = 0}},
       .elements = {.arity = 2}},
      [](const sim::Params& params, const sim::Elements& ties) {
        return std::make_unique<Spring>(params, ties);
      }});
}
