// Welded particles, which keep their relative positions as one rigid piece.
#include <algorithm>
#include <vector>

#include "core/plugin/constraint_params.h"
#include "core/plugin/plugin.h"

namespace {

// Three particles a, b, c keep their distances, and all others their position in the frame of
// these,
//   p = a + alpha u + beta w + gamma u x w,  u = b - a, w = c - a,
// three equations each, which are independent whatever the form of the piece. Particles on one line
// need two reference particles, p = a + alpha u.
class Weld final : public sim::Constraint {
 public:
  explicit Weld(const sim::Elements& on) : ids_(on.ids) {
    if (ids_.size() < 2)
      throw sim::Error(sim::ErrorKind::kScene,
                       {"constraint 'weld'", "", "it joins one particle", "name two or more"});
  }

  void bind(const sim::ParticleView& start) override {
    const auto at = [&](int i) { return start.position(i); };
    const auto farthest = [&](const auto& measure) {
      return *std::max_element(ids_.begin(), ids_.end(),
                               [&](int i, int j) { return measure(i) < measure(j); });
    };
    // The frame spans particles far apart, for accuracy.
    a_ = farthest([&](int i) { return (at(i) - at(ids_.front())).squaredNorm(); });
    b_ = farthest([&](int i) { return (at(i) - at(a_)).squaredNorm(); });
    const sim::Vec3 u = at(b_) - at(a_);
    c_ = farthest([&](int i) { return u.cross(at(i) - at(a_)).squaredNorm(); });
    sim::Vec3 w = at(c_) - at(a_);
    const double uu = u.squaredNorm();
    constexpr double kFlat = 1e-9;
    if (u.cross(w).norm() <= kFlat * uu) c_ = -1, w = sim::Vec3::Zero();
    if (uu > 0) add_rod(a_, b_, start);
    if (c_ >= 0) {
      add_rod(a_, c_, start);
      add_rod(b_, c_, start);
    }

    const sim::Vec3 normal = u.cross(w);
    const double ww = w.squaredNorm(), uw = u.dot(w), determinant = uu * ww - uw * uw;
    for (const int i : ids_) {
      if (i == a_ || (i == b_ && uu > 0) || i == c_) continue;
      const sim::Vec3 d = at(i) - at(a_);
      Fixed& fixed = fixed_.emplace_back(Fixed{i, 0, 0, 0});
      if (c_ >= 0) {
        fixed.alpha = (ww * d.dot(u) - uw * d.dot(w)) / determinant;
        fixed.beta = (uu * d.dot(w) - uw * d.dot(u)) / determinant;
        fixed.gamma = d.dot(normal) / determinant;
      } else if (uu > 0) {
        fixed.alpha = d.dot(u) / uu;
      }
    }
  }

  sim::RowPattern pattern() const override {
    sim::RowPattern pattern;
    for (const Rod& rod : rods_) pattern.add({rod.i, rod.j});
    for (const Fixed& fixed : fixed_)
      for (int axis = 0; axis < 3; ++axis) {
        if (c_ >= 0)
          pattern.add({fixed.i, a_, b_, c_});
        else if (!rods_.empty())
          pattern.add({fixed.i, a_, b_});
        else
          pattern.add({fixed.i, a_});
      }
    return pattern;
  }

  void evaluate(const sim::ParticleView& p, const sim::Rows& rows) const override {
    sim::Vec3* gradient = rows.gradient;
    std::size_t row = 0;
    for (const Rod& rod : rods_) {
      const double inverse = 1 / rod.length;
      const sim::Vec3 d = p.position(rod.i) - p.position(rod.j);
      rows.phi[row] = 0.5 * (d.squaredNorm() * inverse - rod.length);
      *gradient++ = inverse * d;
      *gradient++ = -inverse * d;
      rows.drive[row] = 0;
      rows.bias[row++] = inverse * (p.velocity(rod.i) - p.velocity(rod.j)).squaredNorm();
    }
    const auto position = [&](int i) { return i >= 0 ? p.position(i) : sim::Vec3(); };
    const auto velocity = [&](int i) { return i >= 0 ? p.velocity(i) : sim::Vec3(); };
    const sim::Vec3 origin = position(a_);
    const sim::Vec3 u = position(b_) - origin, w = c_ >= 0 ? position(c_) - origin : sim::Vec3();
    const sim::Vec3 du = velocity(b_) - velocity(a_);
    const sim::Vec3 dw = c_ >= 0 ? velocity(c_) - velocity(a_) : sim::Vec3();
    const sim::Vec3 normal = u.cross(w), turn = 2 * du.cross(dw);
    for (const Fixed& f : fixed_) {
      const sim::Vec3 off = p.position(f.i) - origin - f.alpha * u - f.beta * w - f.gamma * normal;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        sim::Vec3 e;
        e[axis] = 1;
        // e.(u x w) = u.(w x e) = w.(e x u)
        const sim::Vec3 of_u = f.alpha * e + f.gamma * w.cross(e);
        const sim::Vec3 of_w = f.beta * e + f.gamma * e.cross(u);
        rows.phi[row] = off[axis];
        *gradient++ = e;
        *gradient++ = of_u + of_w - e;
        if (!rods_.empty()) *gradient++ = -of_u;
        if (c_ >= 0) *gradient++ = -of_w;
        rows.drive[row] = 0;
        rows.bias[row++] = -f.gamma * turn[axis];
      }
    }
  }

  std::string name(int row) const override {
    const std::size_t rods = rods_.size(), at = static_cast<std::size_t>(row);
    const int i = at < rods ? rods_[at].i : fixed_[(at - rods) / 3].i;
    return "particle " + std::to_string(i);
  }

 private:
  struct Rod {
    int i, j;
    double length;  // m
  };
  struct Fixed {
    int i;
    double alpha, beta, gamma;  // 1, 1, 1/m
  };

  void add_rod(int i, int j, const sim::ParticleView& start) {
    rods_.push_back({i, j, (start.position(i) - start.position(j)).norm()});
  }

  std::vector<int> ids_;
  int a_ = -1, b_ = -1, c_ = -1;
  std::vector<Rod> rods_;
  std::vector<Fixed> fixed_;
};

}  // namespace

SIM_PLUGIN(Constraint, "weld") {
  registrar.add(sim::Plugin<sim::Constraint>{
      {.name = "weld",
       .summary = "particles that keep their places to each other, as one rigid piece",
       .formula = "distances of three particles, and all others in their frame:\n"
                  "p = a + alpha u + beta w + gamma u x w,  u = b - a, w = c - a",
       .params = sim::constraint_params({}),
       .elements = {.arity = 1, .name = "particle"}},
      [](const sim::Params&, const sim::Elements& on) { return std::make_unique<Weld>(on); }});
}
