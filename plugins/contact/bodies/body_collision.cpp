#include "body_collision.h"

#include <algorithm>

#include "core/base/error.h"
#include "core/base/text.h"

namespace sim {
namespace {

using Form = RigidShape::Form;

constexpr double kSunk = 1e-6;  // of a radius: no overlap yet

double deepest(const std::vector<ManifoldPoint>& points) {
  double depth = 0;
  for (const ManifoldPoint& point : points) depth = std::max(depth, -point.gap);
  return depth;
}

[[noreturn]] void refuse_contact(const std::string& why, const std::string& remedy) {
  throw Error(ErrorKind::kScene, {"contact of rigid bodies", "", why, remedy});
}

std::string meters(double length) { return brief(length, 3) + " m"; }

}  // namespace

BodyCollision::BodyCollision(BodyCollisionSpec spec, const Particles& particles,
                             const double* initial)
    : spec_(std::move(spec)), particles_(&particles) {
  for (const RigidBody& body : spec_.bodies) {
    radii_.push_back(body.radius());
    hulls_.push_back(hull_of(body.shape()));
  }
  for (const Collider* const collider : particles.contacts().all())
    if (auto shape = ColliderShape::of(*collider)) shapes_.emplace_back(collider, *shape);
  check_start(initial);
}

double BodyCollision::thinness(int i) const {
  const RigidShape& shape = body(i).shape();
  if (shape.form == Form::kBox)
    return std::min(shape.half[0], std::min(shape.half[1], shape.half[2]));
  if (shape.is_round()) return shape.radius;
  const std::optional<Hull>& hull = hulls_[static_cast<std::size_t>(i)];
  if (!hull) return 2 * radius(i);
  double least = radius(i);
  for (const Hull::Face& face : hull->faces)
    least = std::min(least, face.level - face.normal.dot(hull->middle));
  return least;
}

bool BodyCollision::are_tied(int body, int particle) const {
  return spec_.tied.contains({body, particle});
}

bool BodyCollision::are_joined(int i, int j) const {
  return spec_.joined.contains(std::minmax(i, j));
}

Placed BodyCollision::placed(int i, const RigidState& state) const {
  const std::optional<Hull>& hull = hulls_[static_cast<std::size_t>(i)];
  const RigidBody& of = body(i);
  return {&of.shape(), hull ? &*hull : nullptr, of.place(state, {}), state.axes};
}

const ColliderShape* BodyCollision::shape_of(const Collider& collider) const {
  const auto found =
      std::ranges::find(shapes_, &collider, [](const auto& each) { return each.first; });
  return found == shapes_.end() ? nullptr : &found->second;
}

void BodyCollision::find_contacts(int first, const RigidState& a, int second, const RigidState& b,
                                  double margin, std::vector<ManifoldPoint>& out) const {
  if (second >= bodies()) return touch_point(first, a, b.center, margin, out);
  collide(placed(first, a), placed(second, b), margin, out);
}

void BodyCollision::touch_point(int body, const RigidState& state, const Vec3& point, double margin,
                                std::vector<ManifoldPoint>& out) const {
  const NearestGap gap = gap_from(placed(body, state), point);
  if (gap.gap <= margin)
    out.push_back({point - 0.5 * gap.gap * gap.normal, -gap.normal, gap.gap, 0});
}

void BodyCollision::find_contacts(int first, const RigidState& a, std::size_t collider, double t,
                                  double margin, std::vector<ManifoldPoint>& out) const {
  const Collider& solid = *particles_->contacts().all()[collider];
  if (first >= bodies()) {
    const SurfaceSample sample = solid.query(t, a.center);
    if (sample.gap <= margin)
      out.push_back({a.center - 0.5 * sample.gap * sample.normal, sample.normal, sample.gap, 0});
    return;
  }
  const Placed own = placed(first, a);
  const ColliderShape* const shape = shape_of(solid);
  if (!shape || own.shape->form == Form::kSphere) return collide(own, solid, t, margin, out);
  // The collider's surface is offset outward from the shape by `thick`.
  const double thick = shape->thickness();
  const std::size_t begin = out.size();
  collide(own, shape->at(solid, t), margin + thick, out);
  for (std::size_t k = begin; k < out.size(); ++k) {
    out[k].gap -= thick;
    out[k].x += 0.5 * thick * out[k].normal;
  }
}

void BodyCollision::check_collider(int i, const RigidState& a, std::size_t collider) const {
  const RigidShape& shape = body(i).shape();
  const std::string name = "body " + std::to_string(i) + " (" + shape.name() + ")";
  const Collider& solid = *particles_->contacts().all()[collider];
  const RenderShape drawn = solid.shape(0);
  const bool flat = drawn.form == RenderShape::Form::kPlane ||
                    drawn.form == RenderShape::Form::kNone || drawn.inside;
  if (!flat && !shape.is_round()) {
    if (!shape_of(solid))
      refuse_contact(
          name + " and a collider that is not what it is drawn as do not know how to touch",
          "use a plane, sphere, box or capsule, or a body in the shape of a sphere");
    if (!can_collide(placed(i, a)))
      refuse_contact(name + " is not convex: it touches planes and rooms only",
                     "give it a convex shape, or say touches = false");
  }
  std::vector<ManifoldPoint> points;
  find_contacts(i, a, collider, 0, 0, points);
  if (const double deep = deepest(points); deep > kSunk * radius(i))
    refuse_contact(name + " is " + meters(deep) + " inside a collider at the start", "move it out");
}

void BodyCollision::check_pair(int i, int j, const RigidState& a, const RigidState& b) const {
  const auto name = [&](int k) {
    if (k >= bodies()) return "particle " + std::to_string(k - bodies());
    return "body " + std::to_string(k) + " (" + body(k).shape().name() + ")";
  };
  for (const int k : {i, j})
    if (k < bodies() && !can_collide(placed(k, k == i ? a : b)))
      refuse_contact(name(k) + " is not convex: it touches planes and rooms only",
                     "give it a convex shape, or say touches = false");
  double reach = radius(i), least = radius(i);
  if (j < bodies()) reach += radius(j), least = std::min(least, radius(j));
  if ((a.center - b.center).norm() > reach) return;
  std::vector<ManifoldPoint> points;
  find_contacts(i, a, j, b, 0, points);
  if (const double deep = deepest(points); deep > kSunk * least)
    refuse_contact(
        name(i) + " and " + name(j) + " overlap by " + meters(deep) + " at the start",
        j < bodies() ? "move them apart" : "move it out, or say touches = false of the body");
}

void BodyCollision::check_start(const double* initial) const {
  const ParticleView view = particles_->view(0, initial);
  std::vector<RigidState> states;
  for (const RigidBody& each : spec_.bodies) states.push_back(each.state(view));
  RigidState point;
  for (int i = 0; i < bodies(); ++i) {
    if (!touches(i)) continue;
    const RigidState& own = states[static_cast<std::size_t>(i)];
    for (std::size_t c = 0; c < particles_->contacts().all().size(); ++c) check_collider(i, own, c);
    for (int j = i + 1; j < bodies(); ++j)
      if (touches(j) && !are_joined(i, j))
        check_pair(i, j, own, states[static_cast<std::size_t>(j)]);
    for (int p = 0; p < singles(); ++p) {
      if (are_tied(i, p)) continue;
      point.center = view.position(p);
      check_pair(i, bodies() + p, own, point);
    }
  }
}

}  // namespace sim
