// Hooke springs between pairs of particles, with a rest length.
#include <cmath>

#include "core/particles/springs/dashpots.h"
#include "core/particles/springs/springs.h"
#include "core/plugin/plugin.h"

namespace {

class Spring final : public sim::Force {
 public:
  Spring(const sim::Params& params, const sim::Links& links)
      : family_(params.text("family")),
        links_(links),
        damping_(params.number("damping")),
        stiffness_(params.has("stiffness") ? params.number("stiffness") : std::nan("")),
        rest_(params.has("rest") ? params.number("rest") : std::nan("")) {}

  void bind(const sim::ParticleView& initial) override {
    springs_.emplace(initial.n, [&](const sim::Springs::Visit& visit) {
      links_.for_each([&](const sim::LinkSpec& link, double natural) {
        visit(link.a, link.b, stiffness(link), rest(link, natural, initial));
      });
    });
    bool damped = false;
    const auto each_dashpot = [&](const sim::Springs::Visit& visit) {
      links_.for_each([&](const sim::LinkSpec& link, double) {
        if (damping(link) > 0) visit(link.a, link.b, damping(link), 0);
      });
    };
    each_dashpot([&](int, int, double, double) { damped = true; });
    if (damped) dashpots_.emplace(initial.n, each_dashpot);
    links_ = {};
  }

  bool accumulates() const override { return dashpots_.has_value(); }
  bool depends_on_velocity() const override { return dashpots_.has_value(); }
  void accumulate(const sim::ParticleView& view, sim::Tile tile,
                  sim::ForceSink sink) const override {
    if (dashpots_) dashpots_->accumulate(view, tile, sink);
  }
  bool has_jacobian() const override { return true; }
  void jacobian(const sim::ParticleView& view, sim::BlockSink& sink) const override {
    if (dashpots_) dashpots_->jacobian(view, sink);
  }

  const sim::Springs* springs() const override { return &*springs_; }

  double potential(const sim::ParticleView& view, sim::Tile tile) const override {
    return springs_->potential(view, tile);
  }

  void links(int i, std::vector<sim::Link>& out) const override {
    springs_->at(i, [&](int to, double k, double rest) { out.push_back({family_, to, k, rest}); });
  }

  std::vector<std::pair<std::string, long>> families() const override {
    return {{family_, springs_->count()}};
  }

 private:
  double stiffness(const sim::LinkSpec& link) const {
    const double k = std::isnan(link.stiffness) ? stiffness_ : link.stiffness;
    if (std::isnan(k))
      throw sim::Error(sim::ErrorKind::kScene,
                       {"force 'spring'", "", "a spring has no stiffness",
                        "give stiffness in N/m to the force or to the tie"});
    return k;
  }

  double damping(const sim::LinkSpec& link) const {
    return std::isnan(link.damping) ? damping_ : link.damping;
  }

  // What the tie says, else what the force says, else the distance in the grid or at the start.
  double rest(const sim::LinkSpec& link, double natural, const sim::ParticleView& initial) const {
    if (!std::isnan(link.rest)) return link.rest;
    if (!std::isnan(rest_)) return rest_;
    if (!std::isnan(natural)) return natural;
    return sim::length(initial.position(link.a) - initial.position(link.b));
  }

  std::string family_;
  sim::Links links_;
  double damping_, stiffness_, rest_;
  std::optional<sim::Springs> springs_;
  std::optional<sim::Dashpots> dashpots_;  // where any spring is damped
};

}  // namespace

SIM_PLUGIN(kForce, "spring") {
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
                   .doc = "k, unless a tie gives its own",
                   .min = 0},
                  {.name = "rest",
                   .type = ParamType::kNumber,
                   .unit = "m",
                   .doc = "rest length r; if not given, the distance in the grid or at the start",
                   .min = 0},
                  {.name = "damping",
                   .type = ParamType::kNumber,
                   .default_value = 0.0,
                   .unit = "N s/m",
                   .doc = "c along the spring, unless a tie gives its own; sqrt(2 k m) is critical "
                          "for two particles of m kg",
                   .min = 0}},
       .takes_links = true},
      [](const sim::Params& params, const sim::Links& links) {
        return std::make_unique<Spring>(params, links);
      }});
}
