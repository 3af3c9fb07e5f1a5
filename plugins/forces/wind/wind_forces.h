// Wind on a surface: the force of the air on each triangle, a third of it on each corner.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "air.h"
#include "core/base/array.h"
#include "core/base/thread_pool.h"
#include "core/geometry/incidence.h"
#include "core/geometry/triangle_mesh.h"
#include "core/particles/force.h"
#include "wind_law.h"

namespace sim {

// Triangles a, a + b, a + c for the bits a, as in grids; b, c > 0.
struct TriangleRun {
  std::int64_t b = 0, c = 0;
  std::vector<std::uint8_t> bits;  // of the first corner, eight to an entry
};

// Wind on triangles in runs, each evaluated once, at its first corner; the others read their third
// of its force from a ring.
class WindSweep final : public ForceSweep {
 public:
  // All arguments outlive it.
  WindSweep(const WindLaw& law, const Air& air, std::span<const TriangleRun> runs);

  int reach() const override { return reach_; }
  void start(const ParticleView& view, int begin) override;
  void add(const ParticleView& view, Tile tile, ForceSink sink) override;

 private:
  WindLaw law_;
  WindKernels kernels_ = wind_kernels();
  const Air* air_;
  AirNow now_;
  int reach_ = 0;
  std::vector<TriangleRing> rings_;
  Array memory_;
  std::int64_t turn_ = 0;  // the position of the next block in every ring, without wraps
};

class WindForces {
 public:
  WindForces(const WindLaw& law, const Air& air, const TriangleMesh& surface);

  void prepare(const ParticleView& view, ThreadPool& pool);
  void add(Tile tile, ForceSink sink) const;
  // Removes triangles with such an edge. Replaces earlier pairs; an existing sweep is not changed.
  void tear(std::span<const std::array<int, 2>> torn);
  std::unique_ptr<ForceSweep> sweep() const;  // null where some triangles are in no run

 private:
  WindLaw law_;
  const Air* air_;
  WindKernels kernels_ = wind_kernels();
  std::vector<TriangleRun> runs_;
  std::vector<std::vector<std::uint8_t>> whole_;  // the bits of each run before it was torn
  std::vector<std::uint8_t> loose_gone_;          // of each loose triangle; empty: none is
  std::vector<WindSweep> sweeps_;                 // of each thread
  Array sums_;                                    // N, from the runs on each particle: x, y, z
  std::vector<int> loose_;                        // ids of the triangles that fit no run
  Incidence at_;                                  // of those
  Array loose_thirds_;
  std::size_t stride_, loose_stride_;
};

}  // namespace sim
