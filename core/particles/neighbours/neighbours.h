// Neighbour lists of particles with a skin, kept until a particle has moved half of it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/array.h"
#include "core/base/thread_pool.h"
#include "core/particles/neighbours/cell_grid.h"

namespace sim {

// The neighbours of eight particles side by side, each by ascending id: entry k of the particle in
// lane l is the place slots[8 k + l], for k < count[l], and the particle's own place from there up
// to `length`.
struct NeighbourBlock {
  const std::int32_t* slots;
  std::int32_t length;
  std::int32_t count[8];
};

// Particles found around one, by ascending id: their places and coordinates. Memory of `words`
// words of 64 bits of ids, 0 between two calls, tells the order: bit i of all is set for a particle
// found, `before` counts those of the words before.
struct FoundParticles {
  struct Word {
    std::uint64_t bits;
    std::int64_t before;
  };
  Word* ids;
  std::uint64_t* filled;  // a bit for each word that has one
  int words;
  std::int32_t* places;
  double* q[3];
};

struct NeighbourKernels {
  // Finds the particles of some rows of places, of which `order` has the ids, and returns their
  // number.
  int (*sort)(const CellGrid::Rows& rows, const std::int32_t* order, const double* points,
              const FoundParticles& to);
  // Writes the indices in [begin, end) of points at most sqrt(limit) from point `own` and returns
  // their number. Reads and writes up to 7 entries past the end.
  int (*near)(const double* const q[3], int begin, int end, int own, double limit,
              std::int32_t* found);
};
NeighbourKernels neighbour_kernels();  // for this machine

// Verlet lists (Verlet (1967), Phys. Rev. 159, 98-103) of all neighbours of each particle. The
// entries beyond the cutoff depend on the past; a sum that takes the entries in order and those
// beyond the cutoff as exact zeros has the same bits from every list. Particles are sorted by
// cells, so that neighbours are near in memory: each has a `place`, blocks have eight places, and
// the last block is padded with empty places.
class Neighbours {
 public:
  Neighbours() = default;
  // Cutoff > 0 and skin >= 0, in m.
  Neighbours(double cutoff, double skin);

  // Updates the lists to hold every pair less than the cutoff apart. False if every position is as
  // at the last call. Throws Error{kScene} if the lists would take more than 4 GiB.
  bool update(const ParticleView& view, ThreadPool& pool);

  std::span<const NeighbourBlock> blocks() const { return blocks_; }
  const double* points() const { return points_.data(); }  // x, y, z, 0 of each place
  int place(int id) const { return place_[static_cast<std::size_t>(id)]; }
  int id(int place) const { return order_[static_cast<std::size_t>(place)]; }
  long builds() const { return builds_; }
  std::int64_t entries() const;  // on all lists

  // Calls f(id) for every entry on the list of a particle, by ascending id.
  template <class F>
  void for_each(int particle, const F& f) const {
    const int at = place(particle);
    const NeighbourBlock& block = blocks_[static_cast<std::size_t>(at / 8)];
    for (std::int32_t k = 0; k < block.count[at % 8]; ++k) f(id(block.slots[8 * k + at % 8]));
  }

 private:
  // A part of the lists, written by one thread.
  struct Share {
    ArrayOf<std::int32_t> slots;
    std::size_t needed = 0;
    // Scratch: the particles in the cells around one, and which of them are near.
    std::vector<FoundParticles::Word> ids;
    std::vector<std::uint64_t> filled;
    std::vector<std::int32_t> places, near;
    Array q[3];
    int count = 0;
  };
  void build(const ParticleView& view, ThreadPool& pool);
  void list(int first, int last, Share& share);

  double range_ = 0, half_skin_ = 0;
  NeighbourKernels kernels_ = neighbour_kernels();
  CellGrid grid_;
  std::span<const std::int32_t> order_;
  std::vector<std::int32_t> place_;
  std::vector<NeighbourBlock> blocks_;
  std::vector<Share> shares_;
  Array points_, built_[3];  // now, of each place; when the lists were built, of each id
  long builds_ = 0;
};

}  // namespace sim
