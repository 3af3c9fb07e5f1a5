#include "core/particles/fluid/fluid_solid.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/text.h"

namespace sim {
namespace {

constexpr double kWidest = 2;  // distances of neighbours in the fluid, an edge of the mesh

std::size_t at(int i) { return static_cast<std::size_t>(i); }

}  // namespace

double FluidSolid::kernel(double rr) const {
  const double q = std::sqrt(rr) / law_.smoothing, u = 1 - 0.5 * q;
  return u > 0 ? u * u * (u * u) * (2 * q + 1) : 0;
}

void FluidSolid::bind(const FluidLaw& law, const ParticleView& initial) {
  law_ = law;
  const auto refuse = [](const std::string& why, const std::string& remedy) {
    throw Error(ErrorKind::kScene, {"solid of force 'fluid'", "", why, remedy});
  };
  const double spacing = fluid_spacing(law.volume, law.dimensions);
  double longest = 0;
  for (const TriangleMesh::Edge& edge : surface_->edges())
    longest =
        std::max(longest, (initial.position(edge.ends[0]) - initial.position(edge.ends[1])).norm());
  if (longest > kWidest * spacing)
    refuse("its edges are up to " + brief(longest, 3) + " m long, and the particles of the fluid " +
               brief(spacing, 3) + " m apart: they would pass through",
           "give it a mesh width of about " + brief(spacing, 3) + " m");
  ids_.assign(surface_->ids().begin(), surface_->ids().end());
  std::ranges::sort(ids_);
  ids_.erase(std::unique(ids_.begin(), ids_.end()), ids_.end());
  place_of_.assign(at(initial.n), -1);
  for (std::size_t k = 0; k < ids_.size(); ++k) place_of_[at(ids_[k])] = static_cast<int>(k);
  places_.assign(ids_.size(), Vec3(HUGE_VAL, HUGE_VAL, HUGE_VAL));
  forces_.resize(ids_.size());
  points_.resize(ids_.size());
  weights_.assign(ids_.size(), 1);
  update(initial);
  for (std::size_t k = 0; k < ids_.size(); ++k) {
    double sum = 0;
    each_near(places_[k], [&](const Point&, const Vec3&, double rr) { sum += kernel(rr); });
    weights_[k] = 1 / (law_.scale * sum);
  }
}

bool FluidSolid::update(const ParticleView& view) {
  bool moved = false;
  for (std::size_t k = 0; k < ids_.size(); ++k) {
    const Vec3 x = view.position(ids_[k]);
    moved = moved || !(x == places_[k]);
    places_[k] = x;
  }
  if (!moved) return false;
  low_ = high_ = places_[0];
  for (std::size_t k = 0; k < ids_.size(); ++k) {
    points_[k] = {places_[k], static_cast<int>(k)};
    low_ = low_.cwiseMin(places_[k]);
    high_ = high_.cwiseMax(places_[k]);
  }
  std::ranges::sort(points_, [](const Point& a, const Point& b) {
    return a.x.x() < b.x.x() || (a.x.x() == b.x.x() && a.index < b.index);
  });
  return true;
}

// visit(point, d, r^2) of those nearer than 2 h, in an order that places alone decide.
template <class Visit>
void FluidSolid::each_near(const Vec3& x, const Visit& visit) const {
  const double reach = 2 * law_.smoothing, limit = reach * reach;
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (x[axis] < low_[axis] - reach || x[axis] > high_[axis] + reach) return;
  auto point = std::ranges::lower_bound(points_, x.x() - reach, {},
                                        [](const Point& each) { return each.x.x(); });
  for (; point != points_.end() && point->x.x() <= x.x() + reach; ++point) {
    const Vec3 d = x - point->x;
    if (const double rr = d.squaredNorm(); rr < limit) visit(*point, d, rr);
  }
}

double FluidSolid::density(const Vec3& x) const {
  double sum = 0;
  each_near(x, [&](const Point& point, const Vec3&, double rr) {
    sum += weights_[at(point.index)] * kernel(rr);
  });
  return law_.scale * sum;
}

void FluidSolid::begin_forces() { std::ranges::fill(forces_, Vec3()); }

Vec3 FluidSolid::push(const Vec3& x, double slope) {
  Vec3 sum;
  if (slope == 0) return sum;
  const double factor = 5 * law_.volume * law_.scale / (law_.smoothing * law_.smoothing) * slope;
  each_near(x, [&](const Point& point, const Vec3& d, double rr) {
    const double u = 1 - 0.5 * std::sqrt(rr) / law_.smoothing;
    const Vec3 force = factor * weights_[at(point.index)] * (u * u * u) * d;
    sum += force;
    forces_[at(point.index)] -= force;
  });
  return sum;
}

void FluidSolid::add(Tile tile, ForceSink sink) const {
  auto id = std::ranges::lower_bound(ids_, tile.begin);
  for (; id != ids_.end() && *id < tile.end; ++id)
    sink.add(*id, forces_[static_cast<std::size_t>(id - ids_.begin())]);
}

}  // namespace sim
