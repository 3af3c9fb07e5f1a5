// Walls of a fluid, and the gap of each particle to them.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/base/array.h"
#include "core/particles/collider.h"
#include "core/particles/neighbours/neighbours.h"

namespace sim {

// The fluid continues behind a wall as its mirror image. A pair at a distance of r whose gaps are
// g_i and g_j has images that are sqrt(r^2 + 4 g_i g_j) apart and, if two or three walls meet at
// right angles, images of images, with the sum of g_i g_j over the walls under the root. For planes
// that is exact, for curved walls a shape as smooth as the gap. The mirror is slightly behind the
// surface that particles touch: a particle in it would coincide with its image, which would not
// repel it.
class MirrorBoundary {
 public:
  static constexpr int kMost = 16;  // a room has six

  // Sides of colliders count one by one. Throws Error{kScene} for more than kMost.
  void add(std::unique_ptr<Collider> collider);

  void bind(const ParticleView& initial, double spacing);  // m, of neighbours at rest
  bool move() const { return move_; }
  int count() const { return static_cast<int>(mirrors_.size()); }

  // Called on one thread, before find(), at each new time.
  void look(double t);
  unsigned planes() const { return are_planes_; }  // of look(): a bit for each wall that is one
  void reserve(std::size_t blocks);
  // The gaps of the places of blocks [begin, end), `places` in all, to walls less than `reach`
  // away.
  void find(double t, const double* points, int places, double reach, int begin, int end);

  // For each block, a bit for each wall near it.
  const std::uint16_t* near() const { return near_.data(); }
  // The normal and the gap of a wall, four numbers a place. If it is not near, the gap is 2 reach,
  // or undefined for a plane.
  const double* seen(int wall) const { return seen_[static_cast<std::size_t>(wall)].data(); }
  // The speed, m/s, of a wall along its normal, where it is nearest to x.
  double speed(int wall, double t, const Vec3& x, const Vec3& normal) const {
    return mirrors_[static_cast<std::size_t>(wall)]->query(t, x).velocity.dot(normal);
  }

 private:
  std::vector<std::unique_ptr<Collider>> mirrors_;
  PrimitiveSurface planes_[kMost];  // of the planes, at the time of look()
  unsigned are_planes_ = 0;
  std::vector<std::uint16_t> near_;
  std::vector<Array> seen_;
  double behind_ = 0;
  bool move_ = false;
};

}  // namespace sim
