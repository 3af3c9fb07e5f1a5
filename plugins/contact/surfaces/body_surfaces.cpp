#include "body_surfaces.h"

#include <algorithm>

#include "core/particles/elements/mesh_intersections.h"

namespace sim {

BodySurfaces::BodySurfaces(const BodyGeometry& bodies, int particles) : bodies_(&bodies) {
  elements_.first = particles;
  for (int b = 0; b < bodies.bodies(); ++b) {
    if (!bodies.touches(b)) continue;
    each_part(bodies.body(b).shape(), [&](const RigidShape& part, const Vec3& at,
                                          const Mat3& axes) { add(b, part, at, axes); });
    for (int i = 0; i < particles; ++i)
      if (bodies.are_tied(b, i)) elements_.tied.insert({b, i});
  }
  from_.resize(slot(particles) + vertices_.size());
  displacement_.resize(from_.size());
  dirty_.resize(from_.size());
  motions_.resize(slot(bodies.bodies()));
}

void BodySurfaces::add(int body, const RigidShape& part, const Vec3& at, const Mat3& axes) {
  const int first = elements_.first + static_cast<int>(vertices_.size());
  const auto add_vertex = [&](const Vec3& x) {
    vertices_.push_back({body, bodies_->body(body).weights(at + axes * x)});
    elements_.radii.push_back(part.radius);
  };
  const auto add_triangle = [&](const TriangleMesh::Triangle& t) {
    elements_.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    elements_.body_of.push_back(body);
  };
  if (part.is_round()) {
    const Vec3 end(0, part.form == RigidShape::Form::kCapsule ? 0.5 * part.length : 0, 0);
    add_vertex(-end);
    if (end.y() > 0) add_vertex(end);
    return add_triangle({0, 0, end.y() > 0 ? 1 : 0});
  }
  const RigidShape mesh = mesh_of(part);
  for (const Vec3& x : mesh.points) add_vertex(x);
  for (const auto& t : mesh.triangles) add_triangle(t);
}

// The sum is relative to the first particle, for the rounding.
template <class At>
Vec3 BodySurfaces::sum(const Vertex& vertex, const At& at) const {
  const auto first = slot(bodies_->body(vertex.body).first());
  const Vec3 origin = at(first);
  Vec3 sum = origin;
  for (std::size_t p = 1; p < vertex.weights.size(); ++p)
    sum += vertex.weights[p] * (at(first + p) - origin);
  return sum;
}

std::vector<Vec3> BodySurfaces::places(const ParticleView& view) const {
  std::vector<Vec3> list(slot(view.n));
  for (int i = 0; i < view.n; ++i) list[slot(i)] = view.position(i);
  for (const Vertex& vertex : vertices_)
    list.push_back(sum(vertex, [&](std::size_t i) { return list[i]; }));
  return list;
}

// Both ends are the weighted sums of positions, so that the end of a step is the start of the next.
SurfacePoints BodySurfaces::points(const SurfacePoints& particles) {
  std::ranges::copy(particles.from, from_.begin());
  std::ranges::copy(particles.displacement, displacement_.begin());
  std::ranges::copy(particles.dirty, dirty_.begin());
  std::size_t id = slot(elements_.first);
  for (const Vertex& vertex : vertices_) {
    from_[id] = sum(vertex, [&](std::size_t i) { return from_[i]; });
    displacement_[id] =
        sum(vertex, [&](std::size_t i) { return from_[i] + displacement_[i]; }) - from_[id];
    const auto first = dirty_.begin() + bodies_->body(vertex.body).first();
    dirty_[id++] = *std::max_element(first, first + RigidBody::kParticles);
  }
  return {from_, displacement_, dirty_};
}

int BodySurfaces::vertex_of(const SurfacePair& pair) const {
  const auto& ids = pair.ids;
  const std::size_t second = pair.kind == PairKind::kEdgeEdge ? 2 : 1;
  return ids[0] >= elements_.first ? ids[0] : ids[second] >= elements_.first ? ids[second] : -1;
}

const ContactMaterial& BodySurfaces::material(const SurfacePair& pair) const {
  return bodies_->surface(vertex(vertex_of(pair)).body);
}

// The principal axes as the particles span them after the share s of their displacements.
std::array<Vec3, 3> BodySurfaces::axes_of(const RigidBody& body, double s) const {
  std::array<Vec3, 3> axes;
  for (std::size_t k = 0; k < 3; ++k) {
    Vec3 director = Vec3::Zero();
    for (int p = 0; p < RigidBody::kParticles; ++p) {
      const auto id = slot(body.first() + p);
      director += RigidBody::sign(p, k) * (from_[id] + s * displacement_[id]);
    }
    axes[k] = director.normalized();
  }
  return axes;
}

void BodySurfaces::find_motions(std::span<const double> inverse_mass) {
  for (int b = 0; b < bodies_->bodies(); ++b) {
    const RigidBody& body = bodies_->body(b);
    BodyMotion& motion = motions_[slot(b)];
    motion.inverse_mass = 1 / body.mass();
    Vec3 center = Vec3::Zero();
    for (std::size_t p = 0; p < motion.arms.size(); ++p) {
      const std::size_t id = slot(body.first()) + p;
      motion.arms[p] = from_[id] + displacement_[id];
      center += 0.25 * motion.arms[p];
      if (inverse_mass[id] == 0) motion.inverse_mass = 0;
    }
    for (Vec3& arm : motion.arms) arm -= center;
    motion.inverse_inertia = Mat3::Zero();
    const auto axes = axes_of(body, 1);
    for (std::size_t k = 0; k < 3; ++k)
      motion.inverse_inertia += outer(axes[k], axes[k]) / body.moments()[k];
  }
}

// The point on the surface is c + sum_k o_k d_k, with c the nearest point of the vertices, the
// directors d_k = sum_p sign_pk x_p / (4 extent_k) and o the way of the radius in their frame: the
// weights of x_p are those of c and sum_k o_k sign_pk / (4 extent_k).
void BodySurfaces::extend(const SurfacePair& pair, const Separation& apart, double s,
                          ContactRow& row) const {
  const int of_body = vertex_of(pair), number = vertex(of_body).body;
  const RigidBody& body = bodies_->body(number);
  row.ids.fill(-1);
  row.weights.fill(0);
  std::size_t count = RigidBody::kParticles;
  for (std::size_t k = 0; k < pair.ids.size(); ++k) {
    const int id = pair.ids[k];
    if (id < elements_.first) {
      row.ids[count] = id, row.weights[count++] = apart.weights[k];
      continue;
    }
    for (std::size_t p = 0; p < RigidBody::kParticles; ++p)
      row.weights[p] += apart.weights[k] * vertex(id).weights[p];
  }
  if (const double radius = elements_.radius(of_body); radius > 0) {
    const auto axes = axes_of(body, s);
    for (std::size_t k = 0; k < 3; ++k) {
      const double part = -radius * apart.normal.dot(axes[k]) / (4 * body.extent()[k]);
      for (int p = 0; p < RigidBody::kParticles; ++p)
        row.weights[slot(p)] += part * RigidBody::sign(p, k);
    }
  }
  for (int p = 0; p < RigidBody::kParticles; ++p) row.ids[slot(p)] = body.first() + p;
  const BodyMotion& motion = motions_[slot(number)];
  row.body = motion.inverse_mass > 0 ? &motion : nullptr;
}

std::array<int, 4> BodySurfaces::movers(const SurfacePair& pair,
                                        std::span<const double> inverse_mass) const {
  std::array<int, 4> ids = pair.ids;
  for (int& id : ids) {
    if (id < elements_.first) continue;
    const int first = bodies_->body(vertex(id).body).first();
    int p = 0;
    while (p + 1 < RigidBody::kParticles && inverse_mass[slot(first + p)] == 0) ++p;
    id = first + p;
  }
  return ids;
}

std::optional<std::pair<TriangleMesh::Triangle, int>> BodySurfaces::crossing(
    const TriangleBvh& parts, std::span<const Vec3> places) const {
  const auto at = [&](int id) -> const Vec3& { return places[slot(id)]; };
  const auto box_of = [&](const TriangleMesh::Triangle& t) {
    return Aabb{at(t[0]).cwiseMin(at(t[1])).cwiseMin(at(t[2])),
                at(t[0]).cwiseMax(at(t[1])).cwiseMax(at(t[2]))};
  };
  const auto pierces = [&](const TriangleMesh::Triangle& a, const TriangleMesh::Triangle& b) {
    for (std::size_t k = 0; k < 3; ++k)
      if (segment_meets_triangle(at(a[k]), at(a[(k + 1) % 3]), at(b[0]), at(b[1]), at(b[2])))
        return true;
    return false;
  };
  for (std::size_t begin = 0, end = 0; begin < elements_.triangles.size(); begin = end) {
    const int body = elements_.body_of[begin];
    Aabb all = box_of(elements_.triangles[begin]);
    for (end = begin; end < elements_.triangles.size() && elements_.body_of[end] == body; ++end)
      all.add(box_of(elements_.triangles[end]));
    for (std::size_t s = 0; s < parts.triangles().size(); ++s) {
      const TriangleMesh::Triangle& t = parts.triangles()[s];
      const Aabb box = box_of(t);
      if (t[0] >= elements_.first || parts.triangle_gone(s) || !box.meets(all)) continue;
      for (std::size_t k = begin; k < end; ++k) {
        const TriangleMesh::Triangle& u = elements_.triangles[k];
        if (!box.meets(box_of(u)) || (!pierces(t, u) && !pierces(u, t))) continue;
        if (elements_.are_tied(body, t)) continue;
        return std::pair(t, body);
      }
    }
  }
  return {};
}

}  // namespace sim
