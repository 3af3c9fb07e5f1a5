// Impacts among many bodies at once.
#include <catch2/catch.hpp>

#include <cmath>
#include <vector>

#include "plugins/contact/bodies/contact_solver.h"

using namespace sim;

namespace {

constexpr double kStep = 0.01;  // s

// Balls of 1 kg and radius 0.5 m that touch each other.
struct Cluster {
  ThreadPool pool{1};
  std::vector<SolverBody> bodies;
  std::vector<ContactPoint> contacts;

  // A cube of balls that fall towards its center.
  explicit Cluster(int side) {
    const auto at = [side](int i, int j, int k) { return (i * side + j) * side + k; };
    for (int n = 0; n < side * side * side; ++n) {
      const Vec3 place(n / (side * side), n / side % side, n % side);
      const Vec3 random(std::sin(1.0 + 3 * n), std::sin(2.0 + 5 * n), std::sin(3.0 + 7 * n));
      add(0.1 * random - (place - 0.5 * (side - 1) * Vec3(1, 1, 1)));
    }
    for (int i = 0; i < side; ++i)
      for (int j = 0; j < side; ++j)
        for (int k = 0; k < side; ++k) {
          const int own = at(i, j, k);
          if (i + 1 < side) touch(own, at(i + 1, j, k), {-1, 0, 0}, 1);
          if (j + 1 < side) touch(own, at(i, j + 1, k), {0, -1, 0}, 1);
          if (k + 1 < side) touch(own, at(i, j, k + 1), {0, 0, -1}, 1);
        }
    ContactSolver::prepare(contacts, pool);
  }
  // A row at rest but for the first.
  Cluster(int count, double restitution) {
    for (int i = 0; i < count; ++i) add({i == 0 ? 1.0 : 0.0, 0, 0});
    for (int i = 0; i + 1 < count; ++i) touch(i, i + 1, {-1, 0, 0}, restitution);
    ContactSolver::prepare(contacts, pool);
  }

  void add(const Vec3& velocity) {
    SolverBody& body = bodies.emplace_back();
    body.inverse_mass = 1;
    body.velocity = velocity;
  }
  void touch(int first, int second, const Vec3& normal, double restitution) {
    ContactPoint& m = contacts.emplace_back();
    m.first = first, m.second = second;
    m.normal = normal, m.arm1 = -0.5 * normal, m.arm2 = 0.5 * normal;
    m.tiny = 1e-9, m.duration = 0.005, m.active = true;
    m.restitution = restitution;
    m.before = rate(m), m.path_gap = kStep * m.before;
  }
  double rate(const ContactPoint& m) const {
    return m.normal.dot(ContactSolver::velocity(bodies, m));
  }
  double energy() const {
    double sum = 0;
    for (const SolverBody& body : bodies) sum += 0.5 * body.velocity.squaredNorm();
    return sum;
  }
  Vec3 momentum() const {
    Vec3 sum;
    for (const SolverBody& body : bodies) sum += body.velocity;
    return sum;
  }
  double fastest_approach() const {
    double most = 0;
    for (const ContactPoint& m : contacts) most = std::max(most, -rate(m));
    return most;
  }
  void solve() { ContactSolver().solve_restitution(bodies, contacts, kStep, kStep, pool); }
};

}  // namespace

TEST_CASE("impacts among many touching balls end where none approaches, and keep energy",
          "[rigid]") {
  for (const int side : {2, 3}) {
    CAPTURE(side);
    Cluster cluster(side);
    const double energy = cluster.energy();
    const Vec3 momentum = cluster.momentum();
    REQUIRE(cluster.fastest_approach() > 0.5);
    cluster.solve();
    CHECK(cluster.fastest_approach() < 1e-12);
    CHECK(cluster.energy() == Approx(energy).epsilon(1e-12));
    CHECK((cluster.momentum() - momentum).norm() < 1e-13);
  }
}

// A ball at 1 m/s that strikes a row of balls at rest ends with all at one speed if nothing
// rebounds, by a geometric series of impulses.
TEST_CASE("of inelastic impacts only a weak rest is left to resting contact", "[rigid]") {
  for (const double restitution : {0.0, 0.1}) {
    CAPTURE(restitution);
    Cluster row(6, restitution);
    row.solve();
    const double left = row.fastest_approach();
    CHECK(left < (restitution > 0 ? 1e-13 : 1e-3));
    if (restitution == 0) CHECK(left > 1e-6);
    for (const SolverBody& body : row.bodies)
      CHECK(body.velocity[0] == Approx(1.0 / 6).margin(restitution > 0 ? 0.1 : 2e-3));
    CHECK(row.momentum()[0] == Approx(1).epsilon(1e-13));
    CHECK(row.energy() < 0.5);
  }
}

// gap - rate s + a s^2 / 2 has the roots p and q for gap = a p q / 2 and rate = a (p + q) / 2: the
// first that is not negative counts, at most h.
TEST_CASE("the time since a gap closed is the first root of its way back", "[rigid]") {
  constexpr double kH = 0.01;
  const double roots[] = {-3, -1, -0.2, 0, 0.1, 0.35, 0.8, 1.5, 4};  // of h
  const auto first = [](std::initializer_list<double> list) {
    double best = kH;
    for (const double root : list)
      if (root >= 0) best = std::min(best, root);
    return best;
  };
  for (const double a : {-50.0, -1.0, 0.02, 9.81})
    for (const double p : roots)
      for (const double q : roots) {
        CAPTURE(a, p, q);
        const double one = p * kH, other = q * kH;
        // They are known to the root of the rounding where both are the same.
        CHECK(time_since(0.5 * a * one * other, 0.5 * a * (one + other), a, kH) ==
              Approx(first({one, other})).margin(p == q ? 1e-9 : 1e-14));
      }
  for (const double rate : {-2.0, 0.3})
    for (const double p : roots) {
      CAPTURE(rate, p);
      CHECK(time_since(rate * p * kH, rate, 0, kH) == Approx(first({p * kH})).margin(1e-16));
    }
  CHECK(time_since(-1e-3, 0, 0, kH) == kH);  // it never closed
}
