// Broad phase: the pairs of surface elements that may touch in a step, and those that do.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "triangle_bvh.h"

namespace sim {

// A proximity hit: a pair that comes too near during the step.
struct ProximityHit {
  std::size_t pair;
  double s;          // until then it does not
  Separation then;   // at s
  double gap_start;  // m, the distance at the start
};

// The points of pairs in a step, by their ids: m, and whether they moved since the last test.
struct SurfacePoints {
  std::span<const Vec3> from, displacement;
  std::span<const std::uint8_t> dirty;
};

// The list of pairs is kept as long as all particles stay in fat boxes around their old positions,
// in a frame that moves with their mean, and these are not much larger than displacements need.
// Pairs on the list that are not near change no result.
class PairCache {
 public:
  PairCache(TriangleBvh parts, double thickness)
      : parts_(std::move(parts)), thickness_(thickness) {}

  const TriangleBvh& parts() const { return parts_; }
  std::span<const SurfacePair> pairs() const { return pairs_; }

  // See TriangleBvh::tear(); the list is rebuilt.
  void tear(std::span<const std::array<int, 2>> torn) {
    parts_.tear(torn);
    fat_boxes_.clear();
  }

  // Begins a step from these positions along these displacements. Every pair that may come nearer
  // than the reach of rows, 1.5 thicknesses, is listed.
  void begin(const SurfacePoints& points, ThreadPool& pool);
  // Follows changed displacements: the list is rebuilt if it no longer holds; true then.
  bool follow(const SurfacePoints& points, ThreadPool& pool);

  // Calls f(pair number, separation) for those whose distance at the start is less than the reach
  // and may come nearer than the thickness, in their order.
  template <class F>
  void each_near(const F& f) const {
    for (const auto& [pair, start] : near_) f(pair, start);
  }
  void find_near(const SurfacePoints& points, ThreadPool& pool);

  // The pairs with a `dirty` particle that hit: they come nearer than a tenth of their distance at
  // the start, or of the thickness. In their order.
  void find_hits(const SurfacePoints& points, ThreadPool& pool, std::vector<ProximityHit>& hits);

 private:
  // A fat box: a particle stays within `half` of `middle`.
  struct FatBox {
    Vec3 middle;
    double half = -1;
  };
  double half_of(double move) const;  // of the fat box of a displacement of this length, m
  bool holds(const SurfacePoints& points);
  bool loose(std::span<const Vec3> displacement) const;
  void make(const SurfacePoints& points, ThreadPool& pool);
  // The separation of a pair, with the gap between the balls around its points.
  Separation separation(const SurfacePair& pair, const FourPoints& p) const {
    Separation apart = separation_of(pair.kind, p);
    apart.gap -= parts_.radius(pair);
    return apart;
  }
  Vec3 mean(std::span<const Vec3> of) const;
  // True if a pair stays farther apart than the reach through the step, by its distance when the
  // list was made and the motion of its particles since.
  bool far(std::size_t pair, double reach) const {
    const auto& [ids, kind] = pairs_[pair];
    const auto moved = [this, &ids = ids](std::size_t k) { return moved_[slot(ids[k])]; };
    const double others = std::max(moved(2), moved(3));
    return gaps_then_[pair] - (kind == PairKind::kEdgeEdge
                                   ? std::max(moved(0), moved(1)) + others
                                   : moved(0) + std::max(moved(1), others)) >
           reach;
  }
  static FourPoints four(std::span<const Vec3> of, const SurfacePair& pair) {
    return {of[static_cast<std::size_t>(pair.ids[0])], of[static_cast<std::size_t>(pair.ids[1])],
            of[static_cast<std::size_t>(pair.ids[2])], of[static_cast<std::size_t>(pair.ids[3])]};
  }

  struct Near {
    std::size_t pair;
    Separation start;
  };

  TriangleBvh parts_;
  double thickness_;
  std::vector<SurfacePair> pairs_;
  std::vector<double> gaps_;  // of each pair at the start of the step; -infinity: not known yet
  std::vector<double> gaps_then_;  // with all particles in the middle of their covers
  std::vector<FatBox> fat_boxes_;
  std::vector<double> moved_;  // m, from there, at most, in this step
  std::vector<Vec3> middles_;
  Vec3 mean_then_{};
  std::vector<Aabb> boxes_;
  std::vector<Near> near_;
  std::vector<std::vector<Near>> near_by_rank_;
  std::vector<std::vector<ProximityHit>> by_rank_;
};

}  // namespace sim
