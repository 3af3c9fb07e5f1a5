// The effect of colliders on the path of one particle through a step.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/base/error.h"
#include "core/particles/contacts.h"

namespace {

// A solid ball, resting or moving at a constant velocity.
class Ball final : public sim::Collider {
 public:
  Ball(const sim::Vec3& center, double radius, double restitution,
       const sim::Vec3& velocity = sim::Vec3::Zero())
      : center_(center), velocity_(velocity), radius_(radius), restitution_(restitution) {}

  sim::ContactMaterial material() const override { return {restitution_}; }
  double max_speed(double, double) const override { return velocity_.norm(); }
  sim::SurfaceSample query(double t, const sim::Vec3& x) const override {
    const sim::Vec3 d = x - center_ - t * velocity_;
    const double length = d.norm();
    return {.gap = length - radius_,
            .normal = length > 0 ? sim::Vec3(d / length) : sim::Vec3(0, 1, 0),
            .velocity = velocity_};
  }

 private:
  sim::Vec3 center_, velocity_;
  double radius_, restitution_;
};

class Floor final : public sim::Collider {
 public:
  explicit Floor(const sim::Vec3& normal, double restitution = 0)
      : normal_(normal), restitution_(restitution) {}
  sim::ContactMaterial material() const override { return {restitution_}; }
  sim::SurfaceSample query(double, const sim::Vec3& x) const override {
    return {.gap = normal_.dot(x), .normal = normal_};
  }

 private:
  sim::Vec3 normal_;
  double restitution_;
};

// No particles: colliders are tried one way at a time.
template <class... Colliders>
sim::Contacts contacts_of(Colliders... colliders) {
  sim::Contacts contacts;
  (contacts.add(std::make_unique<Colliders>(colliders), "test", sim::ParticleView{}, 0), ...);
  return contacts;
}

sim::StepPath straight(const sim::Vec3& from, const sim::Vec3& by) {
  return {{from, by, sim::Vec3::Zero(), sim::Vec3::Zero()}};
}

}  // namespace

TEST_CASE("a way that touches nothing keeps its bits") {
  const sim::Contacts contacts = contacts_of(Ball({0, 0, 0}, 1, 0.5));
  sim::StepPath path = straight({-3, 1.0000001, 0}, {6, 0, 0});
  contacts.resolve(0, 1, path);
  CHECK_FALSE(path.touched);
  CHECK(path.moved.norm() == 0);
  CHECK(path.velocity_change.norm() == 0);
}

TEST_CASE("a bounce turns the velocity round where the touch is") {
  const sim::Contacts contacts = contacts_of(Floor({0, 1, 0}, 0.5));
  // Down by 2 in the step from a height of 1: at the floor halfway, then up by 0.5.
  sim::StepPath path = straight({0, 1, 0}, {0.25, -2, 0});
  contacts.resolve(0, 1, path);
  CHECK(path.touched);
  CHECK_FALSE(path.resting);
  const sim::Vec3 end = sim::Vec3(0.25, -1, 0) + path.moved;
  CHECK((end - sim::Vec3(0.25, 0.5, 0)).norm() < 1e-15);
  CHECK((path.velocity_change - sim::Vec3(0, 3, 0)).norm() < 1e-15);
}

TEST_CASE("a ball that is passed within a step is not missed") {
  const sim::Contacts contacts = contacts_of(Ball({0, 0, 0}, 0.1, 1));
  for (const double height : {0.0, 0.05, 0.0999, 0.1001}) {
    INFO(height);
    sim::StepPath path = straight({-7.3, height, 0}, {20, 0, 0});  // 100 diameters a step
    contacts.resolve(0, 1, path);
    CHECK(path.touched == (height < 0.1));
  }
}

TEST_CASE("a particle that leaves a ball and comes back through all of it is not missed") {
  const Ball ball({0, 0, 0}, 0.1, 1);
  for (const double above : {0.0, 1e-13, 1e-11, 1e-9, 1e-6}) {
    INFO(above);
    // y = 0.1 + 4 s - 8 s^2 is at the top again at s = 1/2, and at -3.9 at the end.
    const sim::StepPath path{{{0, 0.1 + above, 0}, {0, 4, 0}, {0, -8, 0}, sim::Vec3::Zero()}};
    CHECK(sim::Contacts::first_touch(ball, 0, 1, path) == Approx(0.5).margin(1e-6));
    const sim::StepPath beside{{{0, 0.1 + above, 0}, {1, 4, 0}, {0, -8, 0}, sim::Vec3::Zero()}};
    CHECK(sim::Contacts::first_touch(ball, 0, 1, beside) > 1);
  }
}

TEST_CASE("a particle at rest is hit by a surface that comes, and takes up its velocity") {
  for (const double restitution : {0.0, 0.4, 1.0}) {
    const sim::Contacts contacts = contacts_of(Ball({-2, 0, 0}, 1, restitution, {3, 0, 0}));
    sim::StepPath path = straight({0, 0, 0}, {0, 0, 0});
    contacts.resolve(0, 0.5, path);  // touches at 1/3 s
    REQUIRE(path.touched);
    CHECK(path.velocity_change.x() / 0.5 == Approx((1 + restitution) * 3));
    CHECK(path.moved.x() == Approx((1 + restitution) * 3 * (0.5 - 1.0 / 3)));
  }
}

TEST_CASE("a particle that is pressed on ends on the surface, at rest against it") {
  const sim::Contacts contacts = contacts_of(Ball({0, 0, 0}, 1, 0.8));
  // At rest on top, pulled down: p(s) = (0, 1 - s^2/8, 0), velocity at the end -1/4.
  sim::StepPath path{{{0, 1, 0}, {0, 0, 0}, {0, -0.125, 0}, {0, 0, 0}}};
  contacts.resolve(0, 1, path);
  REQUIRE(path.resting);
  const sim::Vec3 end = sim::Vec3(0, 0.875, 0) + path.moved;
  CHECK(end.y() == Approx(1).epsilon(1e-14));
  sim::ContactWork work;
  const sim::Vec3 held =
      contacts.constrain_velocity(1, end, sim::Vec3(0, -0.25, 0) + path.velocity_change, work);
  CHECK(held.norm() < 1e-15);
}

TEST_CASE("in a corner of several colliders a particle ends outside of all") {
  const double c = std::sqrt(0.5);
  const sim::Contacts contacts = contacts_of(Floor({c, c, 0}, 0.3), Floor({-c, c, 0}));
  for (const double x : {-0.2, 0.0, 0.3}) {
    sim::StepPath path = straight({x, 1, 0}, {-3 * x, -4, 0.5});
    contacts.resolve(0, 1, path);
    REQUIRE(path.touched);
    const sim::Vec3 end = sim::Vec3(-2 * x, -3, 0.5) + path.moved;
    CHECK(end.y() + end.x() > -1e-12);
    CHECK(end.y() - end.x() > -1e-12);
    CHECK(end.z() == 0.5);
  }
}

// By turns, the particle comes up by a few parts in a thousand of its depth.
TEST_CASE("in a narrow wedge a particle ends outside of both surfaces, at rest") {
  for (const double half : {0.1, 0.02, 0.001}) {
    const double c = std::cos(half), s = std::sin(half);
    const sim::Contacts contacts = contacts_of(Floor({c, s, 0}), Floor({-c, s, 0}));
    sim::StepPath path = straight({0, 1, 0}, {0.001 * s, -2, 0});
    contacts.resolve(0, 1, path);
    CHECK_FALSE(path.over_constrained);
    const sim::Vec3 end = sim::Vec3(0.001 * s, -1, 0) + path.moved;
    CHECK(end.norm() < 1e-8);
    sim::Vec3 place(0.001 * s, -0.1, 0);
    CHECK(contacts.push_out(0, place));
    CHECK(s * place.y() > c * std::abs(place.x()) - 1e-9);
    sim::ContactWork work;
    const sim::Vec3 v(0.3, -2, 1);
    const sim::Vec3 held = contacts.constrain_velocity(0, {0, 0, 0}, v, work);
    CHECK((held - sim::Vec3(0, 0, 1)).norm() < 1e-8);
    CHECK(work.lost == Approx(0.5 * (v.squaredNorm() - held.squaredNorm())));
  }
}

// A ball and a floor squeeze the particle by 0.1 m; two walls, which lean towards each other by
// less than rounding shows, come after them.
TEST_CASE("the worst of several colliders decides whether a particle is squeezed") {
  const sim::Contacts contacts = contacts_of(Floor({0, 1, 0}), Ball({0, 0.9, 0}, 1, 0),
                                             Floor({1, 5e-11, 0}), Floor({-1, 5e-11, 0}));
  sim::StepPath path = straight({0, 0, 0}, {0, 0, 0});
  contacts.resolve(0, 1, path);
  CHECK(path.over_constrained);
  sim::Vec3 place(0, 0, 0);
  CHECK_FALSE(contacts.push_out(0, place));
}

TEST_CASE("a particle that was put inside comes out without gaining velocity") {
  const sim::Contacts contacts = contacts_of(Floor({0, 1, 0}, 0.9));
  sim::StepPath path = straight({0, -0.5, 0}, {0, 0, 0});
  contacts.resolve(0, 0.01, path);
  REQUIRE(path.touched);
  CHECK(path.moved.y() == 0.5);
  CHECK(path.velocity_change.norm() == 0);
}

TEST_CASE("a start inside is refused with the particle and the depth, a pinned one is let be") {
  const double zero[] = {0, 0}, y[] = {0.5, -0.25}, mass[] = {1, 1}, held[] = {1, HUGE_VAL};
  sim::ParticleView view{.n = 2, .x = zero, .y = y, .z = zero, .mass = mass};
  sim::Contacts contacts;
  CHECK_THROWS_WITH(
      contacts.add(std::make_unique<Floor>(sim::Vec3(0, 1, 0)), "floor", view, view.n),
      Catch::Contains("particle 1 starts 0.25 m inside"));
  CHECK(contacts.empty());
  view.mass = held;
  contacts.add(std::make_unique<Floor>(sim::Vec3(0, 1, 0)), "floor", view, view.n);
  CHECK_FALSE(contacts.empty());
}
