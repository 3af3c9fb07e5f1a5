#include "body_collision.h"

#include <algorithm>
#include <map>
#include <ranges>
#include <tuple>

#include "core/base/error.h"
#include "core/base/text.h"
#include "sweep_and_prune.h"

namespace sim {
namespace {

using Form = RigidShape::Form;

constexpr double kSunk = 1e-6;               // of a radius: no overlap yet
constexpr std::int64_t kFeatures = 1 << 29;  // of a pair of parts, as many as hulls may have
constexpr double kSame = 1e-6;               // of a radius: points of two parts so near are one

double deepest(const std::vector<ManifoldPoint>& points) {
  double depth = 0;
  for (const ManifoldPoint& point : points) depth = std::max(depth, -point.gap);
  return depth;
}

[[noreturn]] void refuse_contact(const std::string& why, const std::string& remedy) {
  throw Error(ErrorKind::kScene, {"contact of rigid bodies", "", why, remedy});
}

// Parts that share a corner or an end touch at the same point, of which one is kept.
void drop_repeated(std::vector<ManifoldPoint>& points, std::size_t begin, double radius) {
  const double near = kSame * kSame * radius * radius;
  std::size_t end = begin;
  for (std::size_t k = begin; k < points.size(); ++k) {
    const bool known = std::any_of(
        points.begin() + static_cast<std::ptrdiff_t>(begin),
        points.begin() + static_cast<std::ptrdiff_t>(end), [&](const ManifoldPoint& other) {
          return (points[k].x - other.x).squaredNorm() <= near &&
                 (points[k].normal - other.normal).squaredNorm() <= kSame * kSame;
        });
    if (!known) points[end++] = points[k];
  }
  points.resize(end);
}

double thinness_of(const RigidShape& shape, const Hull* hull, double radius) {
  if (shape.form == Form::kBox)
    return std::min(shape.half[0], std::min(shape.half[1], shape.half[2]));
  if (shape.is_round()) return shape.radius;
  if (!hull) return 2 * radius;
  double least = radius;
  for (const Hull::Face& face : hull->faces)
    least = std::min(least, face.level - face.normal.dot(hull->middle));
  return least;
}

// Equal shapes share a hull.
class Hulls {
 public:
  std::shared_ptr<const Hull> of(const RigidShape& shape) {
    if (shape.is_round()) return nullptr;
    Key key{shape.form, {}, shape.triangles};
    std::vector<double>& numbers = std::get<1>(key);
    numbers.assign(shape.half.begin(), shape.half.end());
    for (const Vec3& point : shape.points)
      numbers.insert(numbers.end(), point.begin(), point.end());
    const auto [at, is_new] = known_.try_emplace(std::move(key));
    if (is_new)
      if (std::optional<Hull> hull = hull_of(shape))
        at->second = std::make_shared<const Hull>(std::move(*hull));
    return at->second;
  }

 private:
  using Key = std::tuple<Form, std::vector<double>, std::vector<std::array<int, 3>>>;
  std::map<Key, std::shared_ptr<const Hull>> known_;
};

std::string meters(double length) { return brief(length, 3) + " m"; }

}  // namespace

BodyCollision::BodyCollision(BodyCollisionSpec spec, const Particles& particles,
                             const double* initial)
    : spec_(std::move(spec)), particles_(&particles) {
  Hulls hulls;
  for (const RigidBody& body : spec_.bodies) {
    radii_.push_back(body.radius());
    std::vector<Part>& parts = parts_.emplace_back();
    double& thinness = thinnesses_.emplace_back(HUGE_VAL);
    each_part(body.shape(), [&](const RigidShape& shape, const Vec3& at, const Mat3& axes) {
      Part part{&shape, hulls.of(shape), at, axes, {}, 0};
      const Vec3 middle = part.hull ? part.hull->middle : Vec3();
      part.middle = at + axes * middle;
      part.radius = radius_about(shape, middle);
      thinness = std::min(thinness, thinness_of(shape, part.hull.get(), part.radius));
      parts.push_back(std::move(part));
    });
  }
  for (const Collider* const collider : particles.contacts().all())
    if (auto shape = ColliderShape::of(*collider)) shapes_.emplace_back(collider, *shape);
  check_start(initial);
}

bool BodyCollision::are_tied(int body, int particle) const {
  return spec_.tied.contains({body, particle});
}

bool BodyCollision::are_joined(int i, int j) const {
  return spec_.joined.contains(std::minmax(i, j));
}

Placed BodyCollision::placed(int i, const Part& part, const RigidState& state) const {
  const bool whole = parts(i).size() == 1;
  return {part.shape, part.hull.get(), body(i).place(state, part.at),
          whole ? state.axes : state.axes * part.axes};
}

template <class Take>
void BodyCollision::each_near(int i, const RigidState& state, const Vec3& center, double radius,
                              const Take& take) const {
  const std::span<const Part> all = parts(i);
  for (std::size_t k = 0; k < all.size(); ++k) {
    const double reach = radius + all[k].radius;
    if (all.size() > 1 &&
        (body(i).place(state, all[k].middle) - center).squaredNorm() > reach * reach)
      continue;
    take(all[k], static_cast<int>(k));
  }
}

const ColliderShape* BodyCollision::shape_of(const Collider& collider) const {
  const auto found =
      std::ranges::find(shapes_, &collider, [](const auto& each) { return each.first; });
  return found == shapes_.end() ? nullptr : &found->second;
}

void BodyCollision::find_contacts(int first, const RigidState& a, int second, const RigidState& b,
                                  double margin, std::vector<ManifoldPoint>& out) const {
  if (second >= bodies()) return touch_point(first, a, b.center, margin, out);
  const std::size_t begin = out.size(), others = parts(second).size();
  each_near(first, a, b.center, radius(second) + margin, [&](const Part& own, int i) {
    const Placed at = placed(first, own, a);
    each_near(second, b, body(first).place(a, own.middle), own.radius + margin,
              [&](const Part& other, int j) {
                const std::size_t from = out.size();
                collide(at, placed(second, other, b), margin, out);
                for (std::size_t k = from; k < out.size(); ++k)
                  out[k].feature += kFeatures * (i * static_cast<std::int64_t>(others) + j);
              });
  });
  if (parts(first).size() > 1 || others > 1) drop_repeated(out, begin, radius(first));
}

void BodyCollision::touch_point(int body, const RigidState& state, const Vec3& point, double margin,
                                std::vector<ManifoldPoint>& out) const {
  const std::size_t begin = out.size();
  each_near(body, state, point, margin, [&](const Part& part, int k) {
    const NearestGap gap = gap_from(placed(body, part, state), point);
    if (gap.gap <= margin)
      out.push_back({point - 0.5 * gap.gap * gap.normal, -gap.normal, gap.gap, kFeatures * k});
  });
  if (parts(body).size() > 1) drop_repeated(out, begin, radius(body));
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
  const ColliderShape* const shape = shape_of(solid);
  const std::size_t begin = out.size(), count = parts(first).size();
  for (std::size_t i = 0; i < count; ++i) {
    const Part& part = parts(first)[i];
    if (count > 1 && solid.query(t, body(first).place(a, part.middle)).gap > part.radius + margin)
      continue;
    const Placed own = placed(first, part, a);
    const std::size_t from = out.size();
    if (!shape || own.shape->form == Form::kSphere) {
      collide(own, solid, t, margin, out);
      for (std::size_t k = from; k < out.size(); ++k) out[k].rounding = own.shape->radius;
    } else {
      // The collider's surface is offset outward from the shape by `thick`.
      const double thick = shape->thickness();
      collide(own, shape->at(solid, t), margin + thick, out);
      for (std::size_t k = from; k < out.size(); ++k) {
        out[k].gap -= thick;
        out[k].x += 0.5 * thick * out[k].normal;
      }
    }
    for (std::size_t k = from; k < out.size(); ++k)
      out[k].feature += kFeatures * static_cast<std::int64_t>(i);
  }
  if (count > 1) drop_repeated(out, begin, radius(first));
}

std::string BodyCollision::name_of(int i) const {
  if (i >= bodies()) return "particle " + std::to_string(i - bodies());
  return "body " + std::to_string(i) + " (" + body(i).shape().name() + ")";
}

void BodyCollision::check_collider(int i, const RigidState& a, std::size_t collider) const {
  const std::string name = name_of(i);
  const Collider& solid = *particles_->contacts().all()[collider];
  const RenderShape drawn = solid.shape(0);
  const bool flat = drawn.form == RenderShape::Form::kPlane ||
                    drawn.form == RenderShape::Form::kNone || drawn.inside;
  for (const Part& part : parts(i)) {
    if (flat || part.shape->is_round()) continue;
    if (!shape_of(solid))
      refuse_contact(
          name + " and a collider that is not what it is drawn as do not know how to touch",
          "use a plane, sphere, box or capsule, or a body in the shape of a sphere");
    if (!can_collide(placed(i, part, a)))
      refuse_contact(name + " is not convex: it touches planes and rooms only",
                     "give it a convex shape, or say touches = false");
  }
  std::vector<ManifoldPoint> points;
  find_contacts(i, a, collider, 0, 0, points);
  if (const double deep = deepest(points); deep > kSunk * radius(i))
    refuse_contact(name + " is " + meters(deep) + " inside a collider at the start", "move it out");
}

// Whether each of its parts is.
bool BodyCollision::is_convex(int i, const RigidState& state) const {
  return std::ranges::all_of(parts(i),
                             [&](const Part& part) { return can_collide(placed(i, part, state)); });
}

// Throws if a body is not convex, and others may touch it.
void BodyCollision::check_convex(int i, const RigidState& state) const {
  if (is_convex(i, state)) return;
  const auto meets_body = [&](int j) { return j != i && touches(j) && !are_joined(i, j); };
  const auto meets_particle = [&](int p) { return !are_tied(i, p) && !leaves_out(p); };
  if (std::ranges::any_of(std::views::iota(0, bodies()), meets_body) ||
      std::ranges::any_of(std::views::iota(0, singles()), meets_particle))
    refuse_contact(name_of(i) + " is not convex: it touches planes and rooms only",
                   "give it a convex shape, or say touches = false");
}

void BodyCollision::check_pair(int i, int j, const RigidState& a, const RigidState& b) const {
  const double least = j < bodies() ? std::min(radius(i), radius(j)) : radius(i);
  std::vector<ManifoldPoint> points;
  find_contacts(i, a, j, b, 0, points);
  if (const double deep = deepest(points); deep > kSunk * least)
    refuse_contact(
        name_of(i) + " and " + name_of(j) + " overlap by " + meters(deep) + " at the start",
        j < bodies() ? "move them apart" : "move it out, or say touches = false of the body");
}

void BodyCollision::check_start(const double* initial) const {
  const ParticleView view = particles_->view(0, initial);
  std::vector<RigidState> states;
  std::vector<Ball> balls;
  SweepAndPrune near;
  for (int i = 0; i < bodies(); ++i) {
    states.push_back(body(i).state(view));
    balls.push_back({states.back().center, radius(i)});
    if (touches(i)) near.take(i);
  }
  const auto state_of = [&](int i) -> const RigidState& {
    return states[static_cast<std::size_t>(i)];
  };
  for (int i = 0; i < bodies(); ++i) {
    if (!touches(i)) continue;
    for (std::size_t c = 0; c < particles_->contacts().all().size(); ++c)
      check_collider(i, state_of(i), c);
    check_convex(i, state_of(i));
  }
  near.update(balls, [&](int i, int j) { return are_joined(i, j); });
  for (const auto& [i, j] : near.pairs()) check_pair(i, j, state_of(i), state_of(j));
  RigidState point;
  for (int p = 0; p < singles(); ++p) {
    point.center = view.position(p);
    near.each_near(point.center, 0, [&](int i) {
      if (!SweepAndPrune::meet(balls[static_cast<std::size_t>(i)], {point.center})) return;
      if (are_tied(i, p) || (leaves_out(p) && !is_convex(i, state_of(i)))) return;
      check_pair(i, bodies() + p, state_of(i), point);
    });
  }
}

}  // namespace sim
