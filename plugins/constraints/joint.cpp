// Ball joints: pairs of points that stay together.
#include <vector>

#include "core/plugin/constraint_params.h"
#include "core/plugin/plugin.h"

namespace {

class Joint final : public sim::Constraint {
 public:
  explicit Joint(const sim::Elements& pairs) {
    pairs.for_each([&](const sim::Element& pair) {
      ids_.insert(ids_.end(), pair.ids.begin(), pair.ids.end());
    });
  }

  sim::RowPattern pattern() const override {
    sim::RowPattern pattern;
    for (std::size_t k = 0; k < ids_.size(); k += 2)
      for (int axis = 0; axis < 3; ++axis) pattern.add({ids_[k], ids_[k + 1]});
    return pattern;
  }

  void evaluate(const sim::ParticleView& p, const sim::Rows& rows) const override {
    sim::Vec3* gradient = rows.gradient;
    std::size_t row = 0;
    for (std::size_t k = 0; k < ids_.size(); k += 2) {
      const sim::Vec3 d = p.position(ids_[k]) - p.position(ids_[k + 1]);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        sim::Vec3 e;
        e[axis] = 1;
        *gradient++ = e;
        *gradient++ = -e;
        rows.phi[row] = d[axis];
        rows.drive[row] = 0;
        rows.bias[row++] = 0;
      }
    }
  }

  std::string name(int row) const override { return "joint " + std::to_string(row / 3); }

 private:
  std::vector<int> ids_;
};

}  // namespace

SIM_PLUGIN(Constraint, "joint") {
  registrar.add(sim::Plugin<sim::Constraint>{
      {.name = "joint",
       .summary = "ball joints: points of rigid bodies, or particles, that stay together",
       .formula = "x_a - x_b = 0",
       .params = sim::constraint_params({}),
       .elements = {.arity = 2, .name = "joint"}},
      [](const sim::Params&, const sim::Elements& pairs) {
        return std::make_unique<Joint>(pairs);
      }});
}
