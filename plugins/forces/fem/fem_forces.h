// Elastic cells between particles: each is evaluated once, eight side by side, and every particle
// then gathers its share in the order of the cells.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "constitutive_law.h"
#include "core/base/array.h"
#include "core/base/thread_pool.h"
#include "core/particles/continuum_force.h"

namespace sim {

// Blocks of eight cells; the last block is padded with its last cell.
struct FemCells {
  int nodes = 4;
  const double* points = nullptr;     // x y z 0 of each particle
  const std::int32_t* ids = nullptr;  // [block][node][lane], counted from the first of these
  const double* rest = nullptr;       // [block][point][weight, gradient of nodes 1 ...][lane]
};

struct FemKernels {
  // Forces of blocks, in N: [block][node][axis][lane].
  void (*evaluate)(const ConstitutiveLaw&, const FemCells&, double* forces, int begin, int end);
  // The energy of the cells of a list, in J.
  double (*energy)(const ConstitutiveLaw&, const FemCells&, const int* list, int count);
};
FemKernels solid_kernels();

class FemForces {
 public:
  // 4 or 10 ids a cell.
  FemForces(const ConstitutiveLaw& law, std::vector<int> ids, int nodes);

  // The places at which the body is at rest. Throws Error{kScene} naming a cell without a volume,
  // or one whose nodes on edges turn it inside out.
  void bind(const ParticleView& rest);

  void prepare(const ParticleView& view, ThreadPool& pool);
  // The next two see the view that was prepared.
  void add(Tile tile, ForceSink sink) const;
  double potential(Tile tile) const;
  void jacobian(const ParticleView& view, JacobianSink& sink) const;
  void couplings(std::vector<std::array<int, 2>>& pairs) const;  // as those of a force
  CellQuality quality(const ParticleView& view) const;

 private:
  int cell_count() const { return static_cast<int>(ids_.size()) / nodes_; }
  // A quadrature point of a cell: its weight, the gradient of a node, the deformation there.
  double weight(int cell, int point) const { return rest(cell, point)[0]; }
  Vec3 gradient(int cell, int point, int node) const;
  Mat3 deformation(const ParticleView& view, int cell, int point) const;
  const double* rest(int cell, int point) const;
  FemCells blocks() const;

  ConstitutiveLaw law_;
  std::vector<int> ids_;
  int nodes_, points_;
  std::vector<std::int32_t> block_ids_;
  Array packed_, rest_, forces_;
  int begin_ = 0, end_ = 0;  // the particles from the lowest to behind the highest
  // In forces_, of particle begin_ + i: [first_[i], first_[i + 1]); the cells that begin at it:
  // likewise.
  std::vector<std::size_t> first_, places_;
  std::vector<int> cells_first_, cells_of_;
  FemKernels kernels_ = solid_kernels();
};

}  // namespace sim
