// Particles of a solid's surface as the boundary of a fluid.
#pragma once

#include <memory>
#include <vector>

#include "core/particles/elements/triangle_mesh.h"
#include "core/particles/fluid/fluid_law.h"
#include "core/particles/force.h"

namespace sim {

// They count in the densities of the fluid near them, by weights w_b that make one layer stand for
// all of the solid behind it, and have no energy of their own (Akinci, Ihmsen, Akinci, Solenthaler
// & Teschner (2012), ACM Trans. Graph. 31(4) 62, with densities by numbers):
//   n_i += scale sum_b w_b w(r_ib/h),    1 / w_b = scale sum_b' w(r_bb'/h) at the start
//   f_i = 5 V scale/h^2 e'_i sum_b w_b (1 - q/2)^3 (x_i - x_b) = -dU/dx_i,   f_b the opposite
// So momentum is exact and U is still all the energy. No friction. A lattice of the fluid at rest
// ends 1.34 spacings before a plane layer of its own spacing (h = 1.5 of them): the surface that it
// feels lies 0.84 spacings outside of the mesh, which keeps it from passing through.
class FluidSolid {
 public:
  void set(std::shared_ptr<const TriangleMesh> surface) { surface_ = std::move(surface); }
  bool empty() const { return surface_ == nullptr; }

  // Throws Error{kScene} where the mesh is so wide that the fluid would pass through.
  void bind(const FluidLaw& law, const ParticleView& initial);
  bool has(int id) const { return !empty() && place_of_[static_cast<std::size_t>(id)] >= 0; }

  // At each new view, on one thread; false where no particle of it has moved.
  bool update(const ParticleView& view);
  // What it adds to n of a particle of the fluid at x.
  double density(const Vec3& x) const;
  // Forces on its particles: first none, then those of a particle of the fluid, whose own it gives.
  void begin_forces();
  Vec3 push(const Vec3& x, double slope);  // slope: e' there
  void add(Tile tile, ForceSink sink) const;

 private:
  struct Point {
    Vec3 x;
    int index;  // among ids_
  };
  double kernel(double rr) const;  // of r^2
  template <class Visit>
  void each_near(const Vec3& x, const Visit& visit) const;

  std::shared_ptr<const TriangleMesh> surface_;
  FluidLaw law_;
  std::vector<int> ids_, place_of_;  // ascending; of each particle, -1: not of it
  std::vector<double> weights_;
  std::vector<Vec3> places_, forces_;  // by ids_
  std::vector<Point> points_;          // from left to right
  Vec3 low_, high_;
};

}  // namespace sim
