// Rods: pairs of particles keep their distance.
#include <cmath>
#include <vector>

#include "core/particles/bridges.h"
#include "core/plugin/constraint_params.h"
#include "core/plugin/plugin.h"

namespace {

class Distance final : public sim::Constraint, public sim::Breakable {
 public:
  Distance(const sim::Params& params, const sim::Elements& ties)
      : ties_(ties),
        length_of_(ties_, params, "length"),
        strain_of_(ties_, params, "break_strain"),
        force_of_(ties_, params, "break_force") {
    ties_.for_each([&](const sim::Element& tie) {
      by_strain_ = by_strain_ || !std::isnan(strain_of_(tie));
      breaks_ = breaks_ || by_strain_ || !std::isnan(force_of_(tie));
    });
  }

  // The length of a rod is the given one, its step in a grid, or its distance at the start.
  void bind(const sim::ParticleView& start) override {
    ties_.for_each([&](const sim::Element& tie) {
      const int a = tie.ids[0], b = tie.ids[1];
      double length = length_of_(tie);
      if (std::isnan(length)) length = tie.length;
      if (std::isnan(length)) length = (start.position(a) - start.position(b)).stableNorm();
      bridges_.add(static_cast<int>(rods_.size()), a, b, tie.parts);
      rods_.push_back({a, b, length});
      limits_.push_back({or_none(length * (1 + strain_of_(tie))), or_none(force_of_(tie))});
      if (!(length > 0) || !(length < 1e150))
        throw sim::Error(sim::ErrorKind::kScene,
                         {"constraint 'distance'", "",
                          name_of(rods_.back()) + " is of length " + std::to_string(length) + " m",
                          "give it a length > 0, or leave out one of the particles"});
    });
    length_of_ = strain_of_ = force_of_ = {};
    ties_ = {};
    all_ = rods_;
    broken_.assign(all_.size(), 0);
  }

  sim::RowPattern pattern() const override {
    sim::RowPattern pattern;
    for (const Rod& rod : rods_) pattern.add({rod.a, rod.b});
    return pattern;
  }

  void evaluate(const sim::ParticleView& p, const sim::Rows& rows) const override {
    sim::Vec3* gradient = rows.gradient;
    for (std::size_t r = 0; r < rods_.size(); ++r) {
      const Rod& rod = rods_[r];
      const double inverse = 1 / rod.length;
      const sim::Vec3 d = p.position(rod.a) - p.position(rod.b);
      const sim::Vec3 w = p.velocity(rod.a) - p.velocity(rod.b);
      rows.phi[r] = 0.5 * (d.squaredNorm() * inverse - rod.length);
      *gradient++ = inverse * d;
      *gradient++ = -inverse * d;
      rows.drive[r] = 0;
      rows.bias[r] = inverse * w.squaredNorm();
    }
  }

  void curvature(const sim::ParticleView& /*view*/, double* pairs) const override {
    for (const Rod& rod : rods_) {
      const double inverse = 1 / rod.length;
      for (const double c : {inverse, -inverse, inverse}) *pairs++ = c;
    }
  }

  std::string name(int row) const override { return name_of(rods_[static_cast<std::size_t>(row)]); }

  std::string note() const override {
    if (!by_strain_) return {};
    return "rods keep their length, so that break_strain does not break them; break_force is the "
           "tension that they bear";
  }

  sim::Breakable* breakable() override { return breaks_ ? this : nullptr; }
  int ties() const override { return static_cast<int>(all_.size()); }
  std::array<int, 2> ends(int tie) const override {
    const Rod& rod = all_[static_cast<std::size_t>(tie)];
    return {rod.a, rod.b};
  }
  double energy(const sim::ParticleView&, int) const override { return 0; }

  // The force of a row on a is lambda (x_a - x_b) / length: it pulls where lambda < 0.
  void find_overloaded(const sim::ParticleView& p, std::span<const double> multipliers,
                       std::vector<int>& out) const override {
    std::size_t row = 0;
    for (std::size_t tie = 0; tie < all_.size(); ++tie) {
      if (broken_[tie]) continue;
      const Rod& rod = all_[tie];
      const double length = (p.position(rod.a) - p.position(rod.b)).norm();
      const double tension = -multipliers[row++] * length / rod.length;
      if (length > limits_[tie].length || tension > limits_[tie].tension)
        out.push_back(static_cast<int>(tie));
    }
  }
  void find_bridges(sim::TornPairs torn, std::vector<int>& out) const override {
    bridges_.find(torn, out);
  }

  void set_broken(std::span<const int> ties) override {
    std::ranges::fill(broken_, std::uint8_t{0});
    for (const int tie : ties) broken_[static_cast<std::size_t>(tie)] = 1;
    rods_.clear();
    for (std::size_t tie = 0; tie < all_.size(); ++tie)
      if (!broken_[tie]) rods_.push_back(all_[tie]);
  }

 private:
  struct Rod {
    int a, b;
    double length;  // m
  };
  struct Limits {
    double length, tension;  // m, N
  };

  static double or_none(double limit) { return std::isnan(limit) ? HUGE_VAL : limit; }
  static std::string name_of(const Rod& rod) {
    return "rod " + std::to_string(rod.a) + "-" + std::to_string(rod.b);
  }

  sim::Elements ties_;
  sim::ElementValues length_of_, strain_of_, force_of_;
  std::vector<Rod> all_, rods_;  // in the order of the scene; those that are whole
  std::vector<Limits> limits_;   // of all
  std::vector<std::uint8_t> broken_;
  sim::Bridges bridges_;
  bool breaks_ = false, by_strain_ = false;
};

}  // namespace

SIM_PLUGIN(Constraint, "distance") {
  registrar.add(sim::Plugin<sim::Constraint>{
      {.name = "distance",
       .summary = "rigid rods, ropes and cloth that do not stretch",
       .formula = "(|x_a - x_b|^2 - length^2) / (2 length) = 0",
       .source = "Witkin (1997), Physically based modeling: constrained dynamics",
       .params =
           sim::constraint_params({{.name = "length",
                                    .unit = "m",
                                    .doc = "length of the rods; default: as at the start",
                                    .per_tie = true,
                                    .min = 0},
                                   {.name = "break_force",
                                    .unit = "N",
                                    .doc = "tension beyond which a rod breaks at the end of "
                                           "a step, as --tension tells it, without impacts; if "
                                           "not given, none does",
                                    .per_tie = true,
                                    .min = 0},
                                   {.name = "break_strain",
                                    .doc = "likewise |d| / length - 1; rods keep their length, "
                                           "so that break_force is what breaks them",
                                    .per_tie = true,
                                    .min = 0}}),
       .elements = {.arity = 2, .name = "rod"}},
      [](const sim::Params& params, const sim::Elements& ties) {
        return std::make_unique<Distance>(params, ties);
      }});
}
