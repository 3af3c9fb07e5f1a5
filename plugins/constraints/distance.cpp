// Rods: pairs of particles keep their distance.
#include <cmath>
#include <vector>

#include "core/plugin/constraint_params.h"
#include "core/plugin/plugin.h"

namespace {

class Distance final : public sim::Constraint {
 public:
  Distance(const sim::Params& params, const sim::Elements& ties)
      : length_of_(ties, params, "length"), ties_(ties) {}

  // The length of a rod is the given one, its step in a grid, or its distance at the start.
  void bind(const sim::ParticleView& start) override {
    ties_.for_each([&](const sim::Element& tie) {
      const int a = tie.ids[0], b = tie.ids[1];
      double length = length_of_(tie);
      if (std::isnan(length)) length = tie.length;
      if (std::isnan(length)) length = (start.position(a) - start.position(b)).stableNorm();
      rods_.push_back({a, b, length});
      if (!(length > 0) || !(length < 1e150))
        throw sim::Error(sim::ErrorKind::kScene,
                         {"constraint 'distance'", "",
                          name(static_cast<int>(rods_.size()) - 1) + " is of length " +
                              std::to_string(length) + " m",
                          "give it a length > 0, or leave out one of the particles"});
    });
    length_of_ = {};
    ties_ = {};
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

  std::string name(int row) const override {
    const Rod& rod = rods_[static_cast<std::size_t>(row)];
    return "rod " + std::to_string(rod.a) + "-" + std::to_string(rod.b);
  }

 private:
  struct Rod {
    int a, b;
    double length;  // m
  };
  sim::ElementValues length_of_;
  sim::Elements ties_;
  std::vector<Rod> rods_;
};

}  // namespace

SIM_PLUGIN(Constraint, "distance") {
  registrar.add(sim::Plugin<sim::Constraint>{
      {.name = "distance",
       .summary = "rigid rods, ropes and cloth that do not stretch",
       .formula = "(|x_a - x_b|^2 - length^2) / (2 length) = 0",
       .source = "Witkin (1997), Physically based modeling: constrained dynamics",
       .params = sim::constraint_params({{.name = "length",
                                          .unit = "m",
                                          .doc = "length of the rods; default: as at the start",
                                          .per_tie = true,
                                          .min = 0}}),
       .elements = {.arity = 2, .name = "rod"}},
      [](const sim::Params& params, const sim::Elements& ties) {
        return std::make_unique<Distance>(params, ties);
      }});
}
