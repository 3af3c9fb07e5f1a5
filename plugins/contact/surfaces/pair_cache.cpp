#include "pair_cache.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

constexpr double kRowReach = 1.5;   // thicknesses
constexpr double kShareKept = 0.1;  // of a distance
constexpr double kWaysAhead = 2;    // that covers leave room for...
constexpr double kMostAhead = 4;    // ...but no more thicknesses than these
constexpr double kLoose = 4;        // times the needed size: a list of pairs that is too long
constexpr double kUnknown = -HUGE_VAL;

bool swept_apart(const FourPoints& p, const FourPoints& d, PairKind kind, double reach) {
  const std::size_t first = kind == PairKind::kVertexTriangle ? 1 : 2;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double least[2] = {HUGE_VAL, HUGE_VAL}, most[2] = {-HUGE_VAL, -HUGE_VAL};
    for (std::size_t k = 0; k < 4; ++k) {
      const std::size_t side = k < first ? 0 : 1;
      const double a = p[k][axis], b = a + d[k][axis];
      least[side] = std::min({least[side], a, b});
      most[side] = std::max({most[side], a, b});
    }
    if (least[0] - most[1] > reach || least[1] - most[0] > reach) return true;
  }
  return false;
}

template <class T>
void append_all(const std::vector<std::vector<T>>& parts, std::vector<T>& all) {
  all.clear();
  for (const std::vector<T>& part : parts) all.insert(all.end(), part.begin(), part.end());
}

}  // namespace

Vec3 PairCache::mean(std::span<const Vec3> of) const {
  Vec3 sum = Vec3::Zero();
  for (const int i : parts_.vertices()) sum += of[slot(i)];
  return sum / static_cast<double>(parts_.vertices().size());
}

double PairCache::half_of(double move) const {
  return move + std::min(kWaysAhead * move, kMostAhead * thickness_) + 0.5 * thickness_;
}

// True if displacements are much shorter than those that the list was made for.
bool PairCache::loose(std::span<const Vec3> displacement) const {
  const Vec3 drift = mean(displacement);
  double have = 0, need = 0;
  for (const int i : parts_.vertices()) {
    have += fat_boxes_[slot(i)].half;
    need += half_of((displacement[slot(i)] - drift).norm());
  }
  return have > kLoose * need;
}

// The test is in the frame of the mean, in which displacements are straight, too.
bool PairCache::holds(const SurfacePoints& points) {
  const auto& [from, displacement, dirty] = points;
  if (fat_boxes_.empty()) return false;
  const Vec3 shift = mean(from) - mean_then_, drift = mean(displacement);
  bool held = true;
  for (const int i : parts_.vertices()) {
    const FatBox& cover = fat_boxes_[slot(i)];
    const Vec3 start = from[slot(i)] - shift - cover.middle,
               end = start + (displacement[slot(i)] - drift);
    moved_[slot(i)] = std::sqrt(std::max(start.squaredNorm(), end.squaredNorm())) * (1 + 1e-9);
    held = held && moved_[slot(i)] <= cover.half;
  }
  return held;
}

void PairCache::make(const SurfacePoints& points, ThreadPool& pool) {
  const auto& [from, displacement, dirty] = points;
  fat_boxes_.resize(from.size());
  boxes_.resize(from.size());
  moved_.resize(from.size());
  middles_.resize(from.size());
  mean_then_ = mean(from);
  const Vec3 drift = mean(displacement);
  for (const int i : parts_.vertices()) {
    const Vec3 along = displacement[slot(i)] - drift;
    const double move = along.norm(), half = half_of(move);
    fat_boxes_[slot(i)] = {from[slot(i)] + 0.5 * along, half};
    middles_[slot(i)] = fat_boxes_[slot(i)].middle;
    moved_[slot(i)] = 0.5 * move * (1 + 1e-9);
    const double reach = (half + 0.5 * kRowReach * thickness_ + parts_.radius(i)) * (1 + 1e-9) +
                         1e-13 * fat_boxes_[slot(i)].middle.cwiseAbs().maxCoeff();
    const Vec3 sides = Vec3::Constant(reach);
    boxes_[slot(i)] = {fat_boxes_[slot(i)].middle - sides, fat_boxes_[slot(i)].middle + sides};
  }
  parts_.find_pairs(boxes_, pool, pairs_);
  gaps_then_.resize(pairs_.size());
  pool.run_parts(static_cast<int>(pairs_.size()), 64, [&](int begin, int end) {
    for (int i = begin; i < end; ++i)
      gaps_then_[slot(i)] = separation(pairs_[slot(i)], four(middles_, pairs_[slot(i)])).gap;
  });
}

void PairCache::begin(const SurfacePoints& points, ThreadPool& pool) {
  if (!holds(points) || loose(points.displacement)) make(points, pool);
  gaps_.assign(pairs_.size(), kUnknown);
}

bool PairCache::follow(const SurfacePoints& points, ThreadPool& pool) {
  if (holds(points)) return false;
  make(points, pool);
  gaps_.assign(pairs_.size(), kUnknown);
  return true;
}

// Pairs that get no row anyway are skipped, so that the age of the list cannot show in results.
void PairCache::find_near(const SurfacePoints& points, ThreadPool& pool) {
  near_by_rank_.resize(slot(pool.size()));
  const double reach = kRowReach * thickness_;
  pool.run([&](int rank) {
    auto& mine = near_by_rank_[slot(rank)];
    mine.clear();
    const Part part = part_of(static_cast<int>(pairs_.size()), 64, rank, pool.size());
    for (int i = part.begin; i < part.end; ++i) {
      if (far(slot(i), reach)) continue;
      const SurfacePair& pair = pairs_[slot(i)];
      const FourPoints p = four(points.from, pair), d = four(points.displacement, pair);
      if (swept_apart(p, d, pair.kind, thickness_ + parts_.radius(pair))) continue;
      const Separation start = separation(pair, p);
      gaps_[slot(i)] = start.gap;
      if (start.gap < reach && start.gap - relative_motion(pair.kind, d) < thickness_)
        mine.push_back({slot(i), start});
    }
  });
  append_all(near_by_rank_, near_);
}

void PairCache::find_hits(const SurfacePoints& points, ThreadPool& pool,
                          std::vector<ProximityHit>& hits) {
  const auto& [from, displacement, dirty] = points;
  by_rank_.resize(slot(pool.size()));
  pool.run([&](int rank) {
    auto& mine = by_rank_[slot(rank)];
    mine.clear();
    const Part part = part_of(static_cast<int>(pairs_.size()), 64, rank, pool.size());
    for (int i = part.begin; i < part.end; ++i) {
      const SurfacePair& pair = pairs_[slot(i)];
      if (!dirty[slot(pair.ids[0])] && !dirty[slot(pair.ids[1])] && !dirty[slot(pair.ids[2])] &&
          !dirty[slot(pair.ids[3])])
        continue;
      if (far(slot(i), thickness_)) continue;
      const FourPoints p = four(from, pair), d = four(displacement, pair);
      const double radius = parts_.radius(pair);
      double& gap = gaps_[slot(i)];
      if (gap == kUnknown) {
        if (swept_apart(p, d, pair.kind, thickness_ + radius)) continue;
        gap = separation(pair, p).gap;
      }
      const double kept = kShareKept * std::min(gap, thickness_);
      if (kept > 0 && gap - relative_motion(pair.kind, d) > kept) continue;
      const TimeOfImpact approach = time_of_impact(pair.kind, p, d, kept, radius);
      if (approach.hit) mine.push_back({slot(i), approach.s, approach.then, gap});
    }
  });
  append_all(by_rank_, hits);
}

}  // namespace sim
