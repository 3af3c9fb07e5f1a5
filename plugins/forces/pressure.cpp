// Pressure on a surface, outwards: on each triangle p A n, a third of it on each corner.
#include "core/geometry/triangle_mesh.h"
#include "core/particles/elements/element_couplings.h"
#include "core/particles/elements/element_forces.h"
#include "core/particles/elements/torn_faces.h"
#include "core/plugin/plugin.h"

namespace {

using Triangles = sim::ElementForces<3>;

class Pressure final : public sim::Force {
 public:
  explicit Pressure(const sim::Params& params)
      : surface_(params.surface("surface")), pressure_(params.number("pressure")) {}

  void bind(const sim::ParticleView& initial) override {
    triangles_ = Triangles(initial.n, surface_->ids());
  }

  // A n = (b - a) x (c - a) / 2 of a triangle with the corners a, b, c.
  void prepare(const sim::ParticleView& p, sim::ThreadPool& pool) override {
    triangles_.evaluate(pool, [&](int t) {
      if (gone(t))
        return Triangles::Forces{sim::Vec3::Zero(), sim::Vec3::Zero(), sim::Vec3::Zero()};
      const auto [a, b, c] = corners(p, t);
      const sim::Vec3 third = pressure_ / 6 * (b - a).cross(c - a);
      return Triangles::Forces{third, third, third};
    });
  }

  void accumulate(const sim::ParticleView&, sim::Tile tile, sim::ForceSink sink) const override {
    triangles_.add(tile, sink);
  }

  bool depends_on_velocity() const override { return false; }
  bool conservative() const override { return surface_->closed(); }

  bool has_jacobian() const override { return true; }
  void tear(sim::TornPairs torn) override { torn_.assign(torn.begin(), torn.end()); }

  // d (u x v) = u x dv - v x du, with u = b - a and v = c - a.
  void jacobian(const sim::ParticleView& p, sim::JacobianSink& sink) const override {
    for (int t = 0; t < static_cast<int>(surface_->triangles().size()); ++t) {
      if (gone(t)) continue;
      const auto [a, b, c] = corners(p, t);
      const sim::Mat3 by_b = -pressure_ / 6 * sim::cross_matrix(c - a);
      const sim::Mat3 by_c = pressure_ / 6 * sim::cross_matrix(b - a);
      const auto& ids = surface_->triangles()[static_cast<std::size_t>(t)];
      for (const int i : ids) {
        sink.position(i, ids[0], -by_b - by_c);
        sink.position(i, ids[1], by_b);
        sink.position(i, ids[2], by_c);
      }
    }
  }

  bool couplings(std::vector<std::array<int, 2>>& pairs) const override {
    sim::add_element_couplings(surface_->ids(), 3, pairs);
    return true;
  }

  // -p V with the volume V = sum of a.(b x c) / 6 of a closed surface. The force of an open one has
  // no potential if its boundary moves.
  double potential(const sim::ParticleView& p, sim::Tile tile) const override {
    if (!surface_->closed()) return 0;
    double volume = 0;
    triangles_.for_each(tile, [&](int t) {
      if (gone(t)) return;
      const auto [a, b, c] = corners(p, t);
      volume += a.dot(b.cross(c)) / 6;
    });
    return -pressure_ * volume;
  }

 private:
  std::array<sim::Vec3, 3> corners(const sim::ParticleView& p, int triangle) const {
    const auto& [a, b, c] = surface_->triangles()[static_cast<std::size_t>(triangle)];
    return {p.position(a), p.position(b), p.position(c)};
  }

  bool gone(int triangle) const {
    return sim::torn_face(torn_, surface_->triangles()[static_cast<std::size_t>(triangle)]);
  }

  std::shared_ptr<const sim::TriangleMesh> surface_;
  std::vector<std::array<int, 2>> torn_;
  double pressure_;
  Triangles triangles_;
};

}  // namespace

SIM_PLUGIN(Force, "pressure") {
  using sim::ParamType;
  registrar.add(sim::ForcePlugin{
      {.name = "pressure",
       .summary = "a constant pressure on a surface, outwards",
       .formula = "p A n on each triangle of area A and outward normal n, a third on each corner\n"
                  "potential energy -p V of a closed surface around the volume V",
       .params = {{.name = "surface",
                   .type = ParamType::kSurface,
                   .doc = "the surface; outside is where its triangles run counter-clockwise",
                   .required = true},
                  {.name = "pressure",
                   .unit = "Pa",
                   .doc = "inside less outside; below 0 it pulls inwards",
                   .required = true}}},
      [](const sim::Params& params, const sim::Elements&) {
        return std::make_unique<Pressure>(params);
      }});
}
