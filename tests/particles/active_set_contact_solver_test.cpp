// Contact forces on constrained particles against the conditions that define them.
#include "core/particles/constraints/active_set_contact_solver.h"

#include <catch2/catch.hpp>
#include <random>

#include "core/base/slot.h"
#include "core/math/axes.h"

using namespace sim;

namespace {

constexpr int kParticles = 5, kPinned = 4;

// Equations a.x_i + b.x_j = c with vectors of any direction.
class PlainRows final : public Constraint {
 public:
  PlainRows(RowPattern pattern, std::vector<Vec3> gradient)
      : pattern_(std::move(pattern)), gradient_(std::move(gradient)) {}
  RowPattern pattern() const override { return pattern_; }
  void evaluate(const ParticleView&, const Rows& rows) const override {
    std::ranges::copy(gradient_, rows.gradient);
  }

 private:
  RowPattern pattern_;
  std::vector<Vec3> gradient_;
};

// A random problem: two equations, contacts on some of the particles, all linear.
struct Linear final : ActiveSetContactSolver::Problem {
  std::mt19937 dice;
  std::normal_distribution<double> normal;
  std::vector<double> mass, coordinates[3], constant;
  std::vector<Vec3> start, gradient;
  RowPattern pattern;
  std::vector<ContactForce> contacts;
  std::vector<double> offset;  // of each contact: gap = normal.y - offset

  Vec3 some() { return {normal(dice), normal(dice), normal(dice)}; }

  // on[i]: the number of contacts of particle i
  Linear(unsigned seed, std::initializer_list<int> on) : dice(seed) {
    pattern.add({0, 1, kPinned});
    pattern.add({1, 2});
    for (int i = 0; i < kParticles; ++i) {
      mass.push_back(i == kPinned ? HUGE_VAL : std::exp(0.5 * normal(dice)));
      start.push_back(some());
      for (std::size_t axis = 0; axis < 3; ++axis) coordinates[axis].push_back(start.back()[axis]);
    }
    for (std::size_t e = 0; e < pattern.ids.size(); ++e) gradient.push_back(some());
    constant = {normal(dice), normal(dice)};
    for (int i = 0; const int count : on) {
      for (int k = 0; k < count; ++k) {
        const Vec3 n = some();
        contacts.push_back({.particle = i, .normal = n / n.norm()});
        offset.push_back(contacts.back().normal.dot(start[slot(i)]) + 0.5 * normal(dice));
      }
      ++i;
    }
    row_tolerance = gap_tolerance = 1e-13;
    enough = 1e-11;
    slow = 1e-9;
  }
  std::array<double*, 3> axes() {
    return {coordinates[0].data(), coordinates[1].data(), coordinates[2].data()};
  }
  Vec3 at(int i) { return vector_at(axes(), i); }
  bool rows(std::span<double> rest) override {
    for (int r = 0; r < pattern.rows(); ++r) {
      rest[slot(r)] = constant[slot(r)];
      for (int e = pattern.begin[slot(r)]; e < pattern.begin[slot(r) + 1]; ++e)
        rest[slot(r)] += gradient[slot(e)].dot(at(pattern.ids[slot(e)]));
    }
    return true;
  }
  double gap(ContactForce& contact, const Vec3& y) override {
    return contact.normal.dot(y) - offset[slot(static_cast<int>(&contact - contacts.data()))];
  }

  // Solves, and checks that
  //   row(y) = 0,  M (y - y0) = J^T mu + sum of contact forces,
  //   0 <= force, 0 <= gap, one of them 0,  of what holds both ways gap = 0 alone,
  void check() {
    Constraints constraints;
    std::vector<double> zero(kParticles);
    ParticleView view{.n = kParticles, .x = zero.data(), .y = zero.data(), .z = zero.data()};
    view.vx = view.vy = view.vz = zero.data(), view.mass = mass.data();
    constraints.add(std::make_unique<PlainRows>(pattern, gradient), "plain", "", 0, view);
    constraints.set_masses(mass);
    ActiveSetContactSolver solver(constraints);
    // The last contact comes later, as one that the others cause does.
    const std::size_t first = contacts.empty() ? 0 : contacts.size() - 1;
    REQUIRE(solver.solve(std::span(contacts).first(first), gradient, axes(), *this));
    REQUIRE(solver.go_on(contacts, gradient, axes(), *this));

    std::vector<double> rest(2);
    rows(rest);
    for (const double each : rest) CHECK(std::fabs(each) < 1e-10);
    std::vector<Vec3> force(kParticles);
    for (int r = 0; r < pattern.rows(); ++r)
      for (int e = pattern.begin[slot(r)]; e < pattern.begin[slot(r) + 1]; ++e)
        force[slot(pattern.ids[slot(e)])] += solver.multipliers()[slot(r)] * gradient[slot(e)];
    for (std::size_t k = 0; k < contacts.size(); ++k) {
      ContactForce& each = contacts[k];
      force[slot(each.particle)] += each.force * each.normal + each.friction_force;
      const double open = each.normal.dot(at(each.particle)) - offset[k];
      INFO("contact " << k << ", force " << each.force << ", gap " << open);
      if (each.bilateral) {
        CHECK(std::fabs(open) < 1e-10);
      } else {
        // With friction, contacts that would pull after 25 rounds are not released.
        if (each.friction == 0) CHECK(each.force > -1e-8);
        CHECK(open > -1e-10);
        CHECK(std::min(each.force, open) < 1e-8);
      }
      // Friction is a drag: along the surface, against the slip.
      const Vec3 along = tangential(at(each.particle) - each.surface_velocity, each.normal);
      const double friction = each.friction_force.norm();
      CHECK(std::fabs(each.friction_force.dot(each.normal)) < 1e-8);
      if (each.friction == 0)
        CHECK(friction < 1e-8);
      else
        CHECK((along.norm() * each.friction_force + friction * along).norm() < 1e-8);
    }
    for (int i = 0; i < kParticles; ++i)
      if (i == kPinned)
        CHECK((at(i) - start[slot(i)]).norm() == 0);
      else
        CHECK((mass[slot(i)] * (at(i) - start[slot(i)]) - force[slot(i)]).norm() < 1e-8);
  }
};

}  // namespace

// Karush, Kuhn and Tucker's conditions, which the nearest state in the metric of masses alone
// meets.
TEST_CASE("contact forces and multipliers make the nearest state that all allow", "[particles]") {
  for (unsigned seed = 0; seed < 300; ++seed) {
    INFO(seed);
    Linear(seed, {0, 0, 0, 0}).check();
    Linear(seed, {1, 0, 0, 1}).check();
    Linear(seed, {2, 1, 0, 0}).check();
    Linear(seed, {0, 2, 0, 3}).check();
  }
}

TEST_CASE("a contact that holds both ways pulls, too", "[particles]") {
  int pulls = 0;
  for (unsigned seed = 0; seed < 300; ++seed) {
    INFO(seed);
    Linear linear(seed, {1, 2, 0, 1});
    linear.contacts[0].active = linear.contacts[0].bilateral = true;
    linear.check();
    pulls += linear.contacts[0].force < 0;
  }
  CHECK((pulls > 100 && pulls < 200));
}

// Coulomb (1785): a particle on its own is pushed out with f = m missing, and loses as much of its
// slip as the limit mu f + extra takes from it, but not more.
TEST_CASE("friction is at its limit against the slip, or stops it", "[particles]") {
  int slips = 0, sticks = 0, alone = 3;
  for (unsigned seed = 0; seed < 400; ++seed) {
    INFO(seed);
    Linear linear(seed, {1, 0, 1, 1});
    for (ContactForce& each : linear.contacts) {
      each.friction = 0.01 * (1 + seed % 100);
      each.extra_friction = 0.2 * linear.normal(linear.dice);
      each.surface_velocity = linear.start[slot(each.particle)] + 0.5 * linear.some();
    }
    linear.check();
    const ContactForce& contact = linear.contacts.back();
    const Vec3 from = linear.start[slot(alone)];
    const double mass = linear.mass[slot(alone)];
    const double missing = linear.offset.back() - contact.normal.dot(from);
    if (missing <= 0) continue;
    CHECK(contact.force == Approx(mass * missing));
    const Vec3 slip = tangential(from - contact.surface_velocity, contact.normal);
    const double most = std::max(0.0, contact.friction * mass * missing + contact.extra_friction);
    const double lost = most / (mass * slip.norm());
    if (lost > 0.5 && lost < 1.2) continue;  // where 25 rounds are not enough to tell
    ++(lost > 1 ? sticks : slips);
    const Vec3 left = std::max(0.0, 1 - lost) * slip;
    const Vec3 now = tangential(linear.at(alone) - contact.surface_velocity, contact.normal);
    CHECK((now - left).norm() < 2e-3);
    CHECK((contact.friction_force - mass * (left - slip)).norm() < 2e-3 * mass);
  }
  CHECK(slips > 40);
  CHECK(sticks > 20);
}
