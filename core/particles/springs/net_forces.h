// The forces of nets, eight particles at a time.
#pragma once

#include <span>
#include <vector>

#include "core/base/array.h"
#include "core/base/thread_pool.h"
#include "core/particles/force.h"
#include "core/particles/springs/net.h"

namespace sim {

// Positions q, which `points` repeats, four doubles a particle: the far end of a spring is then on
// one cache line.
struct NetKernels {
  // Adds the forces of a net that is not reordered on particles [begin, end), begin a multiple
  // of 8.
  void (*add)(const Net& net, const double* const q[3], const double* points, int begin, int end,
              ForceSink sink);

  // forces := those of a reordered net at places [begin, end), multiples of 8, four doubles a
  // place.
  void (*pack)(const Net& net, const double* const q[3], const double* points, int begin, int end,
               double* forces);
  // Adds these forces to the particles [begin, end), begin a multiple of 8.
  void (*add_packed)(const Net& net, const double* forces, int begin, int end, ForceSink sink);
};

NetKernels net_kernels();  // for this machine

// Adds to `sum` the forces on the particles at `lanes` places from p, one spring at a time, for
// distances too large or too small for the fast path. Same order of sums and, for the ordinary
// springs, the same bits.
void add_net_carefully(const Net& net, const double* const q[3], int p, int lanes,
                       double (*sum)[8]);

class NetForces {
 public:
  NetForces() = default;
  NetForces(std::vector<const Net*> nets, int particles);

  std::span<const Net* const> nets() const { return nets_; }

  // Prepares add() at this view.
  void prepare(const ParticleView& view, ThreadPool& pool);

  // Adds the forces on the particles of a tile that begins at a multiple of 8; the sink is padded.
  void add(const ParticleView& view, Tile tile, ForceSink sink) const;

 private:
  std::vector<const Net*> nets_;
  NetKernels kernels_ = {};
  Array points_;               // x, y, z and nothing for each particle
  std::vector<Array> forces_;  // likewise for each place of each reordered net
};

}  // namespace sim
