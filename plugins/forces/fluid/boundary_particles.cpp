#include "boundary_particles.h"

#include <algorithm>
#include <cmath>

#include "boundary_sampling.h"
#include "core/base/error.h"
#include "core/base/text.h"

namespace sim {
namespace {

// In units of the distance of neighbours in the fluid:
constexpr double kWidestEdge = 2;  // an edge of the mesh
constexpr double kFelt = 0.84;     // how far outside of its particles a plane surface is felt
constexpr double kBent = 0.18;     // how much less, over the radius of a body (3 volume/area)

std::size_t at(int i) { return static_cast<std::size_t>(i); }

Vec3 place_of(const JointNode& node, const ParticleView& view) {
  Vec3 sum = node.weights[0] * view.position(node.ids[0]);
  for (std::size_t p = 1; p < at(node.count); ++p)
    sum += node.weights[p] * view.position(node.ids[p]);
  return sum;
}

}  // namespace

double BoundaryParticles::kernel(double rr) const {
  const double q = std::sqrt(rr) / law_.smoothing, u = 1 - 0.5 * q;
  return u > 0 ? u * u * (u * u) * (2 * q + 1) : 0;
}

void BoundaryParticles::check_mesh(const ParticleView& initial) const {
  const double spacing = fluid_spacing(law_.volume, law_.dimensions);
  double longest = 0;
  for (const TriangleMesh::Edge& edge : surface_->edges())
    longest =
        std::max(longest, (initial.position(edge.ends[0]) - initial.position(edge.ends[1])).norm());
  if (longest > kWidestEdge * spacing)
    throw Error(ErrorKind::kScene, {"solid of force 'fluid'", "",
                                    "its edges are up to " + brief(longest, 3) +
                                        " m long, and the particles of the fluid " +
                                        brief(spacing, 3) + " m apart: they would pass through",
                                    "give it a mesh width of about " + brief(spacing, 3) + " m"});
}

void BoundaryParticles::make_nodes(const ParticleView& initial) {
  const double spacing = fluid_spacing(law_.volume, law_.dimensions);
  nodes_.clear();
  if (surface_) {
    check_mesh(initial);
    std::vector<int> ids(surface_->ids().begin(), surface_->ids().end());
    std::ranges::sort(ids);
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    for (const int id : ids) nodes_.push_back({1, {id}, {1}});
  }
  part_.assign(nodes_.size(), 0);
  if (!bodies_.empty() && law_.dimensions == 2)
    throw Error(ErrorKind::kScene, {"force 'fluid'", "", "in two dimensions it has no bodies",
                                    "leave dimensions out, and make the room thin"});
  for (const auto& body : bodies_) {
    const int first = body->first();
    const double radius = 3 * mass_properties(body->shape()).volume / surface_area(body->shape());
    const double depth = (kFelt - kBent * spacing / radius) * spacing;
    for (const Vec3& point : sample_boundary(body->shape(), depth, spacing))
      nodes_.push_back({4, {first, first + 1, first + 2, first + 3}, body->weights(point)});
    part_.resize(nodes_.size(), part_.empty() ? 1 : part_.back() + 1);
  }
  own_.assign(at(initial.n), false);
  shares_.clear();
  for (std::size_t k = 0; k < nodes_.size(); ++k)
    for (std::size_t p = 0; p < at(nodes_[k].count); ++p) {
      own_[at(nodes_[k].ids[p])] = true;
      shares_.push_back({nodes_[k].ids[p], static_cast<int>(k), nodes_[k].weights[p]});
    }
  std::ranges::stable_sort(shares_, {}, &Share::particle);
}

void BoundaryParticles::bind(const FluidLaw& law, const ParticleView& initial) {
  law_ = law;
  make_nodes(initial);
  places_.assign(nodes_.size(), Vec3(HUGE_VAL, HUGE_VAL, HUGE_VAL));
  forces_.resize(nodes_.size());
  points_.resize(nodes_.size());
  weights_.assign(nodes_.size(), 1);
  update(initial);
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    double sum = 0;
    each_near(places_[k], [&](const Point& point, const Vec3&, double rr) {
      if (part_[at(point.index)] == part_[k]) sum += kernel(rr);
    });
    weights_[k] = 1 / (law_.scale * sum);
  }
}

int BoundaryParticles::body_around(const Vec3& x, const ParticleView& view) const {
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const RigidBody& body = *bodies_[b];
    const int first = body.first();
    const auto place = [&](const Vec3& local) {
      return place_of({4, {first, first + 1, first + 2, first + 3}, body.weights(local)}, view);
    };
    const Vec3 center = place({0, 0, 0}), d = x - center;
    const Vec3 local((place({1, 0, 0}) - center).dot(d), (place({0, 1, 0}) - center).dot(d),
                     (place({0, 0, 1}) - center).dot(d));
    if (is_within(body.shape(), local)) return static_cast<int>(b);
  }
  return -1;
}

bool BoundaryParticles::update(const ParticleView& view) {
  bool moved = false;
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    const Vec3 x = place_of(nodes_[k], view);
    moved = moved || !(x == places_[k]);
    places_[k] = x;
  }
  if (!moved) return false;
  low_ = high_ = places_[0];
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    points_[k] = {places_[k], static_cast<int>(k)};
    low_ = low_.cwiseMin(places_[k]);
    high_ = high_.cwiseMax(places_[k]);
  }
  std::ranges::sort(points_, [](const Point& a, const Point& b) {
    return a.x.x() < b.x.x() || (a.x.x() == b.x.x() && a.index < b.index);
  });
  return true;
}

// Calls visit(point, d, r^2) for those nearer than 2 h, in an order that depends on positions
// alone.
template <class Visit>
void BoundaryParticles::each_near(const Vec3& x, const Visit& visit) const {
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

double BoundaryParticles::density(const Vec3& x) const {
  double sum = 0;
  each_near(x, [&](const Point& point, const Vec3&, double rr) {
    sum += weights_[at(point.index)] * kernel(rr);
  });
  return law_.scale * sum;
}

void BoundaryParticles::begin_forces() { std::ranges::fill(forces_, Vec3()); }

Vec3 BoundaryParticles::push(const Vec3& x, double slope) {
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

void BoundaryParticles::add(Tile tile, ForceSink sink) const {
  auto share = std::ranges::lower_bound(shares_, tile.begin, {}, &Share::particle);
  for (; share != shares_.end() && share->particle < tile.end; ++share)
    sink.add(share->particle, share->weight * forces_[at(share->node)]);
}

}  // namespace sim
