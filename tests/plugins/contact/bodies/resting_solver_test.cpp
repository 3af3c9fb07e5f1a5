// Resting contact of bodies in islands, and with a tolerance.
#include <catch2/catch.hpp>

#include <cmath>
#include <string>
#include <vector>

#include "plugins/contact/bodies/resting_solver.h"
#include "tests/lua/scene_text.h"
#include "tests/support/scenes.h"

using namespace sim;
using namespace sim::test;

namespace {

// Cubes of 1 kg and 1 m on each other, which fall at 1 m/s and slide at `slide` m/s. With a floor
// they stand on a fixed body, the first, instead of a collider.
struct Towers {
  explicit Towers(bool floor = false) : bodies(floor ? 1 : 0) {}

  std::vector<SolverBody> bodies;
  std::vector<ContactPoint> contacts;

  void add(int height, double slide) {
    const int base = static_cast<int>(bodies.size());
    for (int level = 0; level < height; ++level) {
      SolverBody& body = bodies.emplace_back();
      body.inverse_mass = 1;
      body.inverse_inertia = 6 * Mat3::Identity();
      body.velocity = {slide * (level + 1), -1, 0};
      for (int corner = 0; corner < 4; ++corner) {
        ContactPoint& m = contacts.emplace_back();
        const Vec3 along(corner % 2 - 0.5, 0, corner / 2 - 0.5);
        m.first = base + level, m.second = level > 0 ? base + level - 1 : -1;
        m.normal = {0, 1, 0};
        m.arm1 = along - Vec3(0, 0.5, 0), m.arm2 = along + Vec3(0, 0.5, 0);
        if (m.second < 0 && bodies[0].inverse_mass == 0) {
          m.second = m.first, m.first = 0;
          m.normal = -m.normal;
          std::swap(m.arm1, m.arm2);
        }
        m.friction = 0.3, m.active = true, m.duration = 0.01;
      }
    }
  }
  double solve(double tolerance, int threads = 1) {
    ThreadPool pool(threads);
    ContactSolver::prepare(contacts, pool);
    return RestingSolver().solve(bodies, contacts, tolerance, pool);
  }
};

// A wall of bricks of 1 kg, each on the halves of two below, that are struck from all sides. Each
// pair touches at four points with 12 impulses, where 6 hold it.
struct Wall : Towers {
  Wall(int courses, int columns) {
    std::vector<Vec3> at;
    for (int course = 0; course < courses; ++course)
      for (int column = 0; column < columns; ++column) {
        at.emplace_back(column + 0.5 * (course % 2), 0.5 * course, 0);
        SolverBody& body = bodies.emplace_back();
        body.inverse_mass = 1;
        body.inverse_inertia = Mat3::Diagonal({24, 9.6, 9.6});
      }
    for (std::size_t i = 0; i < at.size(); ++i) {
      const auto made_up = [&](double k) { return std::sin(k * (static_cast<double>(i) + 1)); };
      bodies[i].velocity = {0.2 * made_up(1.3), 0.05 * made_up(2.1) - 0.1, 0.5 * made_up(3.7)};
      bodies[i].angular_velocity = {2 * made_up(5.1), 2 * made_up(7.7), 2 * made_up(9.1)};
    }
    const auto touch = [&](std::size_t upper, int lower, double low, double high) {
      for (const double x : {low, high})
        for (const double z : {-0.25, 0.25}) {
          ContactPoint& m = contacts.emplace_back();
          m.first = static_cast<int>(upper), m.second = lower;
          const Vec3 point(x, at[upper].y() - 0.25, z);
          m.arm1 = point - at[upper];
          if (lower >= 0) m.arm2 = point - at[static_cast<std::size_t>(lower)];
          m.normal = {0, 1, 0};
          m.friction = 0.6, m.active = true, m.duration = 0.01;
        }
    };
    for (std::size_t i = 0; i < at.size(); ++i) {
      const double x = at[i].x();
      if (at[i].y() == 0) touch(i, -1, x - 0.5, x + 0.5);
      for (std::size_t j = 0; j < i; ++j)
        if (at[j].y() == at[i].y() - 0.5 && std::fabs(at[j].x() - x) < 0.9)
          touch(i, static_cast<int>(j), std::max(x, at[j].x()) - 0.5, std::min(x, at[j].x()) + 0.5);
    }
  }
};

// How far the impulses are from Signorini's and Coulomb's laws.
double off_the_laws(const Towers& of) {
  double off = 0;
  for (const ContactPoint& m : of.contacts) {
    const Vec3 w = ContactSolver::velocity(of.bodies, m);
    const double rate = m.normal.dot(w), most = m.friction * m.normal_impulse;
    const Vec3 slip = w - rate * m.normal;
    const Vec3 force = m.tangent_impulse[0] * m.u + m.tangent_impulse[1] * m.v;
    off = std::max({off, -m.normal_impulse, -rate, std::fabs(m.normal_impulse * rate),
                    force.norm() - most, std::fabs(force.dot(slip) + most * slip.norm())});
  }
  return off;
}

bool same_bits(const SolverBody& a, const SolverBody& b) {
  return a.velocity == b.velocity && a.angular_velocity == b.angular_velocity &&
         a.translation == b.translation && a.rotation == b.rotation;
}

}  // namespace

TEST_CASE("an island of bodies is solved as if it were alone, on any number of threads",
          "[rigid]") {
  Towers all, first, second;
  for (int k = 0; k < 12; ++k) all.add(k == 0 ? 6 : 10, k == 0 ? 0.02 : 0.03);
  first.add(6, 0.02), second.add(10, 0.03);
  first.solve(1e-12), second.solve(1e-12);
  for (const int threads : {1, 2, 3}) {
    INFO(threads);
    Towers together = all;
    together.solve(1e-12, threads);
    for (std::size_t i = 0; i < 6; ++i) CHECK(same_bits(together.bodies[i], first.bodies[i]));
    for (std::size_t k = 0; k < 11; ++k)
      for (std::size_t i = 0; i < 10; ++i)
        CHECK(same_bits(together.bodies[6 + 10 * k + i], second.bodies[i]));
  }
}

// A fixed body under all of them, and points of theirs that do not touch, join no islands.
TEST_CASE("an island ends at what is fixed and where nothing touches", "[rigid]") {
  Towers all(true), first(true), second(true);
  for (int k = 0; k < 5; ++k) all.add(k == 0 ? 6 : 10, k == 0 ? 0.02 : 0.03);
  first.add(6, 0.02), second.add(10, 0.03);
  first.solve(1e-12), second.solve(1e-12);
  for (const bool near : {false, true}) {
    Towers together = all;
    for (int k = 0; near && k < 4; ++k) {
      ContactPoint& m = together.contacts.emplace_back();
      m.first = 6 + 10 * k, m.second = 16 + 10 * k;  // their tops
      m.normal = {1, 0, 0};
    }
    together.solve(1e-12);
    CHECK(together.bodies[0].velocity == Vec3::Zero());
    for (std::size_t i = 1; i <= 6; ++i) CHECK(same_bits(together.bodies[i], first.bodies[i]));
    for (std::size_t k = 0; k < 4; ++k)
      for (std::size_t i = 1; i <= 10; ++i)
        CHECK(same_bits(together.bodies[6 + 10 * k + i], second.bodies[i]));
  }
}

TEST_CASE("resting impulses obey Signorini's and Coulomb's laws", "[rigid]") {
  for (const double slide : {0.0, 0.02}) {
    INFO(slide);
    Towers tower;
    tower.add(5, slide);
    CHECK(tower.solve(1e-13) <= 1e-13);
    double pressed = 0;
    for (const ContactPoint& m : tower.contacts) {
      const Vec3 w = ContactSolver::velocity(tower.bodies, m);
      const double pull = std::hypot(m.tangent_impulse[0], m.tangent_impulse[1]);
      CHECK(m.normal_impulse >= 0);
      CHECK(w.y() > -1e-11);
      CHECK(std::fabs(m.normal_impulse * w.y()) < 1e-11);
      CHECK(pull <= 0.3 * m.normal_impulse * (1 + 1e-12));
      // Friction of a slipping point is opposite to the slip.
      const Vec3 slip = w - w.y() * m.normal;
      const Vec3 force = m.tangent_impulse[0] * m.u + m.tangent_impulse[1] * m.v;
      CHECK(std::fabs(force.dot(slip) + 0.3 * m.normal_impulse * slip.norm()) < 1e-10);
      if (m.second < 0) pressed += m.normal_impulse;
    }
    // The ground takes the momentum of all.
    double momentum = 0;
    for (const SolverBody& body : tower.bodies) momentum += body.velocity.y();
    CHECK(pressed == Approx(5 + momentum).epsilon(1e-12));
    // Bodies have moved as their impulses say, which act 10 ms before the end.
    for (std::size_t i = 0; i < 5; ++i) {
      const Vec3 gained =
          tower.bodies[i].velocity - Vec3(slide * (static_cast<double>(i) + 1), -1, 0);
      CHECK((tower.bodies[i].translation - 0.01 * gained).norm() < 1e-14);
    }
  }
}

TEST_CASE("bodies that touch at more points than they need are solved to rounding", "[rigid]") {
  Wall wall(10, 10);
  CHECK(wall.solve(1e-10) == 0);
  CHECK(off_the_laws(wall) < 1e-9);
  Wall again(10, 10);
  again.solve(1e-10, 2);
  for (std::size_t i = 0; i < wall.bodies.size(); ++i)
    CHECK(same_bits(wall.bodies[i], again.bodies[i]));
}

TEST_CASE("contact of bodies is solved to the tolerance that the scene gives", "[rigid]") {
  const auto pile = [](const std::string& tolerance) {
    return "local b = {}\nfor i = 0, 26 do local j = i // 9\n b[i + 1] = sim.rigid { shape = "
           "sim.box { half = {0.1, 0.1, 0.1} }, mass = 1, friction = 0.5, position = { 0.3 * (i % "
           "3) + 0.013 * j, 0.11 + 0.21 * j, 0.3 * (i // 3 % 3) + 0.007 * j } } end\nreturn "
           "sim.scene { bodies = b, contact = sim.contact.bodies { tolerance = " +
           tolerance +
           " }, colliders = { sim.collider.plane { friction = 0.5 } }, forces = { "
           "sim.force.gravity {} }, integrator = 'verlet', dt = 0.005, duration = 1 }\n";
  };
  TextRun fine(pile("1e-12"), "verlet", 0.005);
  fine.run_to(0.15);
  double before = HUGE_VAL;
  for (const char* tolerance : {"1e-3", "1e-5", "1e-7"}) {
    INFO(tolerance);
    TextRun run(pile(tolerance), "verlet", 0.005);
    run.run_to(0.15);
    double off = 0;
    for (int i = 0; i < 27; ++i)
      off = std::max(off,
                     (run.system.body_state(i).center - fine.system.body_state(i).center).norm());
    CHECK(off > 0);
    CHECK(off < 0.3 * before);
    // Bodies within the tolerance of a gap are pressed through the whole step, h g h at most.
    CHECK(off < 100 * std::stod(tolerance) + 2.5e-4);
    before = off;
  }
  CHECK_THROWS_WITH(load_text(pile("0.5")), Catch::Contains("tolerance"));
}
