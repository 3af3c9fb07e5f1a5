// Boundary particles of a fluid (Akinci et al. 2012): particles of a surface, and points of rigid
// bodies.
#pragma once

#include <memory>
#include <vector>

#include "core/geometry/triangle_mesh.h"
#include "core/particles/force.h"
#include "core/particles/rigid/rigid_body.h"
#include "fluid_law.h"

namespace sim {

// Boundary particles count in the densities of the fluid near them, by weights w_b that make one
// layer stand for all of the solid behind it, and have no energy of their own (Akinci, Ihmsen,
// Akinci, Solenthaler & Teschner (2012), ACM Trans. Graph. 31(4) 62, with densities by numbers):
//   n_i += scale sum_b w_b w(r_ib/h),    1 / w_b = scale sum_b' w(r_bb'/h) at the start
//   f_i = 5 V scale/h^2 e'_i sum_b w_b (1 - q/2)^3 (x_i - x_b) = -dU/dx_i,   f_b the opposite
// So momentum is exact and U is still all the energy. No friction. A lattice of the fluid at rest
// ends 1.34 spacings before a plane layer of its own spacing (h = 1.5 of them): the effective
// surface is 0.84 spacings outside of the mesh, which keeps the fluid from passing through. The
// points of a body are as far inside of it, so that the effective surface is that of the body, but
// for 0.18 spacings^2/R with R = 3 volume/area: a layer that bends away acts less (fitted to boxes
// and spheres that float). They are sums of its four particles by constant weights, which share the
// force on each by the same (JointNode).
class BoundaryParticles {
 public:
  void set(std::shared_ptr<const TriangleMesh> surface) { surface_ = std::move(surface); }
  void add(std::shared_ptr<const RigidBody> body) { bodies_.push_back(std::move(body)); }
  bool empty() const { return !surface_ && bodies_.empty(); }

  // Throws Error{kScene} if the mesh is so wide that the fluid would pass through, or a body too
  // thin for its points.
  void bind(const FluidLaw& law, const ParticleView& initial);
  // The body that contains x, or -1.
  int body_around(const Vec3& x, const ParticleView& view) const;
  bool has(int id) const { return !empty() && own_[static_cast<std::size_t>(id)]; }

  // Called at each new view, on one thread; false if none of its particles has moved.
  bool update(const ParticleView& view);
  // The density that it adds to n of a fluid particle at x.
  double density(const Vec3& x) const;
  // Forces on its particles: reset first, then the reaction to each fluid particle, whose own force
  // is returned.
  void begin_forces();
  Vec3 push(const Vec3& x, double slope);  // slope: e' there
  void add(Tile tile, ForceSink sink) const;

 private:
  struct Point {
    Vec3 x;
    int index;  // among nodes_
  };
  struct Share {
    int particle, node;
    double weight;
  };
  void make_nodes(const ParticleView& initial);
  void check_mesh(const ParticleView& initial) const;
  double kernel(double rr) const;  // of r^2
  template <class Visit>
  void each_near(const Vec3& x, const Visit& visit) const;

  std::shared_ptr<const TriangleMesh> surface_;
  std::vector<std::shared_ptr<const RigidBody>> bodies_;
  FluidLaw law_;
  std::vector<bool> own_;         // of each particle
  std::vector<JointNode> nodes_;  // those of the surface by ids, then of each body
  std::vector<int> part_;         // of each: 0 the surface, then each body
  std::vector<Share> shares_;     // by particle
  std::vector<double> weights_;
  std::vector<Vec3> places_, forces_;  // of nodes
  std::vector<Point> points_;          // from left to right
  Vec3 low_, high_;
};

}  // namespace sim
