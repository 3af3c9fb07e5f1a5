// The forces of a pair potential on all particles.
#pragma once

#include "core/particles/force.h"
#include "core/particles/neighbours/neighbours.h"
#include "pair_law.h"

namespace sim {

struct PairKernels {
  // forces := those on the particles of blocks [begin, end), four doubles a place; energies := half
  // those of their pairs, in J. Either may be null.
  void (*forces)(const PairLaw& law, const NeighbourBlock* blocks, const double* points, int begin,
                 int end, double* forces, double* energies);
  void (*terms)(const PairLaw& law, const double* squares, PairTerms& terms);
};
PairKernels pair_kernels(const PairLaw& law);  // for this machine

// The law less its value at the cutoff and, with `slope`, less its slope there times r - cutoff.
PairLaw shifted(PairLaw law, bool slope);

// Every pair of particles closer than the cutoff, pinned ones included. The sums of a particle are
// taken by ascending id of its neighbours: they follow from the positions alone, bit for bit, and
// the force of i on j is exactly opposite to that of j on i.
class PairForces {
 public:
  // skin in m: see Neighbours.
  PairForces(const PairLaw& law, double skin);

  // Called first, at each new view. Evaluates the forces unless nothing has moved.
  void prepare(const ParticleView& view, ThreadPool& pool);

  void add(Tile tile, ForceSink sink) const;
  double potential(Tile tile) const;  // half of the energy of each pair at each of its ends, J
  void jacobian(const ParticleView& view, JacobianSink& sink) const;

  const Neighbours& neighbours() const { return neighbours_; }

 private:
  template <class F>
  void for_each_eight(const ParticleView& view, int i, const F& f) const;

  PairLaw law_;
  PairKernels kernels_;
  Neighbours neighbours_;
  Array forces_;            // of each place
  mutable Array energies_;  // of each place, once asked for
  // They are those of these positions; somebody asked for them there, and may do so again.
  mutable bool energies_known_ = false, energies_asked_ = false;
};

}  // namespace sim
