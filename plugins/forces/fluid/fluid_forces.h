// The forces of a fluid on all particles or on some.
#pragma once

#include <optional>
#include <vector>

#include "boundary_particles.h"
#include "core/particles/force.h"
#include "core/particles/neighbours/neighbours.h"
#include "fluid_law.h"
#include "mirror_boundary.h"

namespace sim {

// The given parameters; a smoothing or sound of 0 follows from the particles.
struct FluidDensity {
  double density = 1000;     // kg/m^3
  double smoothing = 0;      // m
  double sound = 0;          // m/s
  double viscosity = 0;      // Pa s
  double alpha = 0;          // of Monaghan's viscosity: mu = rho alpha h c / (2 (d + 2))
  double tension = 0;        // N/m
  bool compressible = true;  // false: without pressure and viscosity, which a projection brings
};

// The arrays that kernels see: four numbers a place, blocks of eight places.
struct FluidBlocks {
  const NeighbourBlock* blocks = nullptr;
  const double* points = nullptr;      // x y z; in `forces` the fourth is e'
  const double* velocities = nullptr;  // m/s
  const std::uint16_t* near = nullptr;
  const double* walls[MirrorBoundary::kMost] = {};
  unsigned planes = 0;                  // a bit for each wall that is one
  double* ties = nullptr;               // J, half the energy of the ties of each place
  double* weights = nullptr;            // of each entry of the lists and its images, by densities()
  const std::size_t* firsts = nullptr;  // the first entries of each block
};
struct FluidKernels {
  // Computes n for the places of blocks [begin, end).
  void (*densities)(const FluidLaw&, const FluidBlocks&, int begin, int end, double* n);
  // f, four numbers a place, and the drag of resistance() if `drag` is not null.
  void (*forces)(const FluidLaw&, const FluidBlocks&, int begin, int end, double* f, double* drag);
  void (*resistance)(const FluidLaw&, const FluidBlocks&, int begin, int end, double* f);
};
FluidKernels fluid_kernels(const FluidLaw& law);  // for this machine

class FluidForces {
 public:
  // `ids`: ascending; none: all particles. A value of 0 follows from the particles: smoothing 1.5
  // times the distance of neighbours at rest, sound ten times the speed of a fall over the largest
  // extent of the fluid at the start.
  FluidForces(const FluidDensity& given, int dimensions, std::vector<int> ids)
      : given_(given), ids_(std::move(ids)) {
    law_.dimensions = dimensions;
  }

  void add_wall(std::unique_ptr<Collider> collider) { mirrors_.add(std::move(collider)); }
  void set_solid(std::shared_ptr<const TriangleMesh> surface) { boundary_.set(std::move(surface)); }
  void add_body(std::shared_ptr<const RigidBody> body) { boundary_.add(std::move(body)); }
  // Throws Error{kScene} if no particle is free, or they are far too close for the density.
  void bind(const ParticleView& initial);

  // Called first, at each new view; evaluates position-dependent data unless nothing has moved.
  void prepare(const ParticleView& view, ThreadPool& pool);

  void add_pressure(Tile tile, ForceSink sink) const {
    add(pressure_, tile, sink);
    if (!boundary_.empty()) boundary_.add(tile, sink);
  }
  void add_viscosity(Tile tile, ForceSink sink) const { add(viscosity_, tile, sink); }
  double potential(Tile tile) const;  // J

  const FluidLaw& law() const { return law_; }
  bool acts() const { return given_.compressible || given_.tension > 0; }  // gives any force
  bool viscous() const { return given_.compressible && (given_.viscosity > 0 || given_.alpha > 0); }
  bool walls_move() const { return mirrors_.move(); }
  double density(int id) const;  // n of a particle, after prepare(); 0: of another
  std::vector<int> uncoupled_particles()
      const;  // particles that are neither its own nor of its boundary

 private:
  ParticleView own(const ParticleView& view, ThreadPool* pool);
  void make_weights();
  void add_boundary_pressure(int places);
  void add(const Array& forces, Tile tile, ForceSink sink) const;
  int index(int id) const { return ids_.empty() ? id : index_[static_cast<std::size_t>(id)]; }

  FluidDensity given_;
  FluidLaw law_;
  std::vector<int> ids_, index_;  // index_: of each particle among ids_, or -1
  std::optional<Neighbours> neighbours_;
  MirrorBoundary mirrors_;
  BoundaryParticles boundary_;
  FluidKernels kernels_ = {};
  Array own_;                              // places of `ids`, one axis after the other
  Array points_, velocities_, densities_;  // of each place, as in FluidBlocks
  Array pressure_, viscosity_, energies_;  // N, N, J
  Array ties_, weights_;
  std::vector<std::size_t> firsts_;
  double t_ = 0;
  bool viscosity_known_ = false;  // viscosity_ is that of the places and velocities_
};

}  // namespace sim
