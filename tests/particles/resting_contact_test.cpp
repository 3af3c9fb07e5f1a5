// Resting contacts on planes and spheres, resolved many at a time, have the bits of one at a time.
#include <catch2/catch.hpp>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <random>

#include "core/base/thread_pool.h"
#include "core/particles/explicit/contact_pass.h"
#include "core/particles/explicit/resting_contact_kernel.h"
#include "core/particles/particles.h"
#include "core/simd/simd_targets.h"
#include "tests/support/kernel_cases.h"

using namespace sim;

namespace {

constexpr double kStep = 0.01;

// A plane or a sphere, inside or outside, that moves at a constant velocity; `told`: as numbers,
// too.
class SdfCollider final : public Collider {
 public:
  SdfCollider(const PrimitiveSurface& at, const ContactMaterial& surface, bool told)
      : at_(at), surface_(surface), told_(told) {}

  ContactMaterial material() const override { return surface_; }
  bool moves() const override { return at_.velocity != Vec3::Zero(); }
  double max_speed(double, double) const override { return at_.velocity.norm(); }
  PrimitiveSurface as_primitive(double t) const override {
    PrimitiveSurface now = at_;
    now.center = center(t);
    return told_ ? now : PrimitiveSurface{};
  }
  SurfaceSample query(double t, const Vec3& x) const override {
    const Vec3 d = x - center(t);
    double distance = at_.normal.dot(d) - at_.radius;
    Vec3 normal = at_.normal;
    if (at_.form == PrimitiveSurface::Form::kSphere) {
      const double length = d.norm();
      distance = length - at_.radius;
      normal = length > 0 ? Vec3(d / length) : Vec3(0, 1, 0);
    }
    if (at_.inside) return {-distance - at_.thickness, -normal, at_.velocity};
    return {distance - at_.thickness, normal, at_.velocity};
  }
  double clearance(double t, const Vec3& middle, const Vec3& half) const override {
    return query(t, middle).gap - half.norm();
  }
  Vec3 advect(double t0, double t1, const Vec3& x) const override {
    return moves() ? x + (center(t1) - center(t0)) : x;
  }

 private:
  Vec3 center(double t) const { return moves() ? at_.center + t * at_.velocity : at_.center; }

  PrimitiveSurface at_;
  ContactMaterial surface_;
  bool told_;
};

struct Case {
  PrimitiveSurface at;
  ContactMaterial surface;
  bool second;  // another plane beside it
};

// A state, what it becomes, and what contact did.
struct Result {
  Array from, to, after;
  ContactWork work;
};

// `touching`: the only particle that lies on the surface, or -1 where most do.
Result contact_succeeded(const Case& c, bool told, bool whole, unsigned seed, int count = 333,
                         int collide = -1) {
  std::mt19937 random(seed);
  const auto number = [&] { return std::uniform_real_distribution<double>(-1, 1)(random); };
  std::vector<double> masses(count);
  for (double& mass : masses) mass = 1.5 + number();
  const Layout layout(count);
  Array x0(layout.size()), x1(layout.size()), a(Layout(count, 3).size()), after(a.size());
  const auto q0 = layout.axes(x0.data()), v0 = layout.axes(x0.data(), 3);
  const auto q = layout.axes(x1.data()), v = layout.axes(x1.data(), 3);
  SdfCollider solid(c.at, c.surface, told);
  for (int i = 0; i < count; ++i) {
    // Most lie on it, some above; most are led in and slide, some are at rest or go off.
    Vec3 place = c.at.center + Vec3(number(), number(), number());
    for (int n = 0; n < 3; ++n) {
      const SurfaceSample sample = solid.query(0, place);
      place -= (sample.gap - (i % 7 == 0 ? 0.003 * (1 + number()) : 0)) * sample.normal;
    }
    if (collide >= 0 && i != collide) place += 0.5 * solid.query(0, place).normal;
    const SurfaceSample sample = solid.query(0, place);
    Vec3 slip = tangential({number(), number(), number()}, sample.normal);
    if (i % 5 == 0) slip = 1e-4 * slip;
    if (i % 11 == 0) slip = Vec3::Zero();
    const double off = i % 13 == 0 ? 0.2 * number() : i % 3 == 0 ? -0.05 * std::fabs(number()) : 0;
    const Vec3 velocity = sample.velocity + slip + off * sample.normal;
    const Vec3 pull = (i % 17 == 0 ? 1 : -1) * 10 * sample.normal + Vec3(number(), number(), 0);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      q0[axis][i] = place[axis];
      v0[axis][i] = velocity[axis];
      v[axis][i] = velocity[axis] + (whole ? kStep : 0.5 * kStep) * pull[axis];
      q[axis][i] = place[axis] + kStep * velocity[axis] + 0.5 * kStep * kStep * pull[axis];
      Layout(count, 3).axes(a.data())[axis][i] = pull[axis];
    }
  }

  ThreadPool pool(1);
  std::vector<int> pinned;
  for (const int i : {4, 40, 41, 332})
    if (i < count && i != collide) pinned.push_back(i);
  Particles particles(masses, pinned, {}, x0.data(), pool);
  particles.add_collider(std::make_unique<SdfCollider>(c.at, c.surface, told), "solid", x0.data(),
                         0);
  if (c.second)
    particles.add_collider(
        std::make_unique<SdfCollider>(
            PrimitiveSurface{PrimitiveSurface::Form::kPlane, {0.4, 0, 0}, {0, 0, 0}, {-1, 0, 0}},
            ContactMaterial{0, 0.1}, told),
        "wall", x0.data(), 0);
  ParticleContactPass contact_pass(particles);
  contact_pass.begin(0, kStep);
  if (whole) {
    contact_pass.end(0, kStep, {q0[0], q0[1], q0[2]}, {v0[0], v0[1], v0[2]}, q, v, 0, count);
  } else {
    contact_pass.resolve_after_drift(0, kStep, {q0[0], q0[1], q0[2]}, {v0[0], v0[1], v0[2]}, q, v,
                                     0, count);
    RestingContactKick kick;
    kick.next = {.keep = 0.99, .gain = 0.5 * kStep, .keeps = nullptr, .gains = nullptr};
    kick.drift = kStep;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (int i = 0; i < count; ++i)
        v[axis][i] += 0.5 * kStep * Layout(count, 3).axes(a.data())[axis][i];
      kick.q[axis] = q[axis];
      kick.v[axis] = v[axis];
      kick.a[axis] = Layout(count, 3).axes(a.data())[axis];
      kick.v_after[axis] = Layout(count, 3).axes(after.data())[axis];
    }
    contact_pass.constrain_after_kick(kStep, kick, 0, count);
  }
  return {std::move(x0), std::move(x1), std::move(after), particles.contacts().work_sums().take()};
}

bool same(const Array& a, const Array& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

}  // namespace

TEST_CASE("what lies on a surface is settled with the same bits many at a time as one at a time") {
  const double c = std::sqrt(0.5);
  const PrimitiveSurface plane{
      PrimitiveSurface::Form::kPlane, {0.1, -0.2, 0.3}, {}, {0, 1, 0}, 0, 0.005};
  PrimitiveSurface slope = plane, side = plane, ball = plane, hollow, moving;
  slope.normal = {c, c, 0};
  side.radius = -0.37;
  ball.form = PrimitiveSurface::Form::kSphere;
  ball.radius = 0.7;
  hollow = moving = ball;
  hollow.inside = true;
  moving.velocity = {0.3, 0.2, -0.1};
  PrimitiveSurface belt = plane;
  belt.velocity = {0.4, 0.05, 0};
  unsigned seed = 1;
  int changed = 0;
  for (const PrimitiveSurface& at : {plane, slope, side, ball, hollow, moving, belt})
    for (const ContactMaterial& surface : {ContactMaterial{0, 0}, ContactMaterial{0.5, 0},
                                           ContactMaterial{0, 0.3}, ContactMaterial{0.2, 2}})
      for (const bool second : {false, true})
        for (const bool whole : {true, false}) {
          CAPTURE(static_cast<int>(at.form), at.inside, at.velocity.norm(), surface.restitution,
                  surface.friction, second, whole);
          const Case each{at, surface, second};
          ++seed;
          const Result one = contact_succeeded(each, false, whole, seed);
          changed += !same(one.from, one.to);
          for (const SimdLevel level : simd_levels()) {
            setenv("SIM_SIMD", simd_name(level), 1);
            const Result many = contact_succeeded(each, true, whole, seed);
            unsetenv("SIM_SIMD");
            CAPTURE(simd_name(level));
            CHECK(same(one.to, many.to));
            CHECK(same(one.after, many.after));
            CHECK(one.work.lost == many.work.lost);
            CHECK(one.work.given == many.work.given);
          }
        }
  CHECK(changed > 0);
}

TEST_CASE("one particle that lies on a surface is settled at any index, the others fly on",
          "[resting_contact_kernel]") {
  PrimitiveSurface plane{PrimitiveSurface::Form::kPlane, {0.1, -0.2, 0.3}, {}, {0, 1, 0}, 0, 0.005};
  PrimitiveSurface ball = plane;
  ball.form = PrimitiveSurface::Form::kSphere;
  ball.radius = 0.7;
  int changed = 0;
  sim_test::for_each_lane([&](int items, int collide) {
    for (const PrimitiveSurface& at : {plane, ball})
      for (const bool whole : {true, false}) {
        const Case each{at, {0.2, 0.3}, false};
        const auto seed = static_cast<unsigned>(items);
        const Result one = contact_succeeded(each, false, whole, seed, items, collide);
        const Result many = contact_succeeded(each, true, whole, seed, items, collide);
        changed += !same(one.from, one.to);
        CAPTURE(static_cast<int>(at.form), whole);
        CHECK(same(one.to, many.to));
        CHECK(same(one.after, many.after));
        CHECK(one.work.lost == many.work.lost);
        CHECK(one.work.given == many.work.given);
      }
  });
  CHECK(changed > 0);
}
