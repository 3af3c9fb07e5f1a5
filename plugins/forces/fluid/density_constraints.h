// The density constraints of an incompressible fluid: densities and their gradients.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/base/array.h"
#include "core/base/thread_pool.h"
#include "core/particles/neighbours/neighbours.h"
#include "fluid_law.h"
#include "mirror_boundary.h"

namespace sim {

// The density gradients of eight places, by ascending id of the neighbour. Entry k of lane l is the
// place slots[8 k + l] and the slope s (1/m), slopes[24 k + 8 axis + l]:
//   dn_i = sum of s.(w_i - w_j)
// for displacements w; an image in walls has two slopes, one after the other: dn_i = sum of a.w_i +
// b.w_j. Slopes are floats, rounded alike on both sides of a pair: those of i and j are exact
// opposites. With viscosity a pair has a weight, too, by which F_i = -sum of weight (s.(v_i - v_j))
// s.
struct DensityConstraintRow {
  const std::int32_t* slots;
  const float* slopes;
  const float* weights;  // 8 k + l
  int length;
  const std::int32_t* image_slots;
  const float* images;
  int image_length;
};

struct DensityConstraintKernels {
  // n of the eight places of a block, without images, and the slope and weight, if requested, of
  // each entry of its list (0 beyond reach).
  void (*slopes)(const FluidLaw&, const NeighbourBlock&, const double* points, int block, double* n,
                 float* slopes, float* weights);
  // For the places of rows [begin, end), four numbers a place: pressure_forces := J' p. p: one a
  // place.
  void (*pressure_forces)(const DensityConstraintRow*, const double* p, int begin, int end,
                          double* pressure_forces);
  // rates := J w. w: four numbers a place.
  void (*rates)(const DensityConstraintRow*, const double* w, int begin, int end, double* rates);
  // viscous_forces := sum of weight (s.(w_i - w_j)) s, four numbers a place.
  void (*viscous_forces)(const DensityConstraintRow*, const double* w, int begin, int end,
                         double* viscous_forces);
};
DensityConstraintKernels density_constraint_kernels();  // for this machine

class DensityConstraints {
 public:
  void add_wall(std::unique_ptr<Collider> collider) { mirrors_.add(std::move(collider)); }
  void bind(const FluidLaw& law, const ParticleView& initial);  // a view of all

  // Computes n and J at these positions, and the effect of moving walls on n.
  void make(const ParticleView& view, ThreadPool& pool);

  int places() const { return 8 * static_cast<int>(rows_.size()); }  // with those of no particle
  int place(int k) const { return neighbours_.place(k); }
  int id(int place) const { return neighbours_.id(place); }
  const double* densities() const { return densities_.data(); }
  const double* wall_rates() const { return wall_rates_.data(); }  // 1/s, of n

  void push(const double* p, double* pressure_forces, ThreadPool& pool) const;
  void rate(const double* displacements, double* rates, ThreadPool& pool) const;
  void apply_viscosity(const double* velocities, double* viscous_forces,
                       ThreadPool& pool) const;  // N

 private:
  // A part of the rows, written by one thread.
  struct Share {
    std::vector<std::int32_t> slots, image_slots;
    std::vector<float> slopes, weights, images;
    std::vector<float> all, all_weights;   // scratch: of a block's list
    std::vector<std::int32_t> lane_slots;  // scratch: images of one place
    std::vector<float> lane_images;
  };
  void make_rows(int begin, int end, double t, Share& share);
  void add_pairs(int block, Share& share);
  void add_images(int block, double t, Share& share);
  void find_images(int place, int block, double t, Share& share);

  FluidLaw law_;
  Neighbours neighbours_;
  MirrorBoundary mirrors_;
  DensityConstraintKernels kernels_ = density_constraint_kernels();
  std::vector<DensityConstraintRow> rows_;
  std::vector<Share> shares_;
  Array densities_, wall_rates_;
};

}  // namespace sim
