#include "mirror_boundary.h"

#include <algorithm>

#include "core/base/error.h"

namespace sim {
namespace {

constexpr double kBehind = 0.25;  // of the distance of neighbours: the mirrors

}  // namespace

void MirrorBoundary::add(std::unique_ptr<Collider> collider) {
  auto sides = collider->sides();
  if (sides.empty()) sides.push_back(std::move(collider));
  for (auto& side : sides) mirrors_.push_back(std::move(side));
  if (mirrors_.size() > kMost)
    throw Error(ErrorKind::kScene, {"force 'fluid'", "",
                                    "its boundary has " + std::to_string(mirrors_.size()) +
                                        " walls, more than " + std::to_string(kMost),
                                    "name fewer colliders, a room has six walls"});
}

void MirrorBoundary::bind(const ParticleView& initial, double spacing) {
  behind_ = kBehind * spacing;
  for (const auto& wall : mirrors_) {
    wall->bind(initial);
    move_ = move_ || wall->moves();
  }
  look(initial.t);
}

void MirrorBoundary::look(double t) {
  are_planes_ = 0;
  for (std::size_t w = 0; w < mirrors_.size(); ++w) {
    if (mirrors_[w]->sampled()) mirrors_[w]->prepare_interval(t, t);
    planes_[w] = mirrors_[w]->as_primitive(t);
    if (planes_[w].form == PrimitiveSurface::Form::kPlane && !planes_[w].inside)
      are_planes_ |= 1U << w;
  }
}

void MirrorBoundary::reserve(std::size_t blocks) {
  near_.resize(blocks);
  if (seen_.empty())
    for (int wall = 0; wall < count(); ++wall) seen_.emplace_back(32 * blocks);
}

void MirrorBoundary::find(double t, const double* points, int places, double reach, int begin,
                          int end) {
  for (int b = begin; b < end; ++b) {
    Vec3 low(HUGE_VAL, HUGE_VAL, HUGE_VAL), high = -low;
    const int last = std::min(8 * b + 8, places);
    for (int p = 8 * b; p < last; ++p)
      for (int axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], points[4 * p + axis]);
        high[axis] = std::max(high[axis], points[4 * p + axis]);
      }
    const Vec3 middle = 0.5 * (low + high), half = 0.5 * (high - low);
    std::uint16_t bits = 0;
    for (int w = 0; w < count(); ++w) {
      const Collider& wall = *mirrors_[static_cast<std::size_t>(w)];
      const PrimitiveSurface& plane = planes_[w];
      const bool plain = are_planes_ >> w & 1;
      double* const seen = seen_[static_cast<std::size_t>(w)].data();
      const double clearance = plain ? plane.gap(middle) - plane.normal.cwiseAbs().dot(half)
                                     : wall.clearance(t, middle, half);
      const bool near = !(clearance + behind_ > reach);
      if (near) bits = static_cast<std::uint16_t>(bits | 1U << w);
      if (plain && !near) continue;  // nobody reads them
      for (int p = 8 * b; p < 8 * b + 8; ++p) {
        double* const out = seen + 4 * static_cast<std::ptrdiff_t>(p);
        out[3] = 2 * reach;
        if (!near || p >= last) continue;
        const Vec3 x(points[4 * p], points[4 * p + 1], points[4 * p + 2]);
        const SurfaceSample sample =
            plain ? SurfaceSample{plane.gap(x), plane.normal} : wall.query(t, x);
        for (int axis = 0; axis < 3; ++axis) out[axis] = sample.normal[axis];
        out[3] = sample.gap + behind_;
      }
    }
    near_[static_cast<std::size_t>(b)] = bits;
  }
}

}  // namespace sim
