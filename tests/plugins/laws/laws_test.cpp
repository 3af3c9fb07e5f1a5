// Laws of contact against closed forms and an independent integration, on every path.
#include <catch2/catch.hpp>
#include <cmath>
#include <set>

#include "core/particles/contact_law.h"
#include "core/study/contract/contract.h"
#include "core/study/energy_balance.h"
#include "tests/lua/scene_text.h"

using namespace sim;
using namespace sim::test;

namespace {

constexpr double kG = 9.81;
constexpr double kStatic = 0.6, kKinetic = 0.3, kSpeed = 0.2;
const std::string kStribeck = "law = sim.law.stribeck { static = 0.6, kinetic = 0.3, speed = 0.2 }";

std::shared_ptr<const ContactLaw> make_law(const std::string& name,
                                           const std::map<std::string, Value>& given) {
  Registry registry({SIM_PLUGIN_DIR});
  const auto& plugin = registry.get<ContactLaw>(name);
  return plugin.make(Params(plugin.title(), plugin.params, given, {}));
}

// The speed of a slide on level ground with Stribeck's friction and a first speed of 1 m/s: with
// w = e^(v / speed), w' = -(g / speed) (kinetic w + static - kinetic).
double speed_at(double t) {
  const double ratio = (kStatic - kKinetic) / kKinetic;
  const double w = (std::exp(1 / kSpeed) + ratio) * std::exp(-kG * kKinetic * t / kSpeed) - ratio;
  return w > 1 ? kSpeed * std::log(w) : 0;
}

// By Simpson's rule.
double way_at(double t) {
  constexpr int kParts = 2000;
  double sum = 0;
  for (int k = 0; k <= kParts; ++k)
    sum += (k == 0 || k == kParts ? 1 : k % 2 ? 4 : 2) * speed_at(t * k / kParts);
  return sum * t / kParts / 3;
}

std::string scene(const std::string& made, const std::string& parts, const std::string& plane,
                  const std::string& before = "") {
  return before + made + "return sim.scene { " + parts +
         ", forces = { sim.force.gravity { g = {0, -9.81, 0} } }, colliders = { "
         "sim.collider.plane { " +
         plane + " } }, integrator = 'rk4', dt = 0.01, duration = 1 }\n";
}

// One particle on a plane that is turned by an angle.
std::string particle(double angle, const std::string& plane, double speed, double height = 0,
                     const std::string& more = "") {
  const auto text = [](double a, double b) {
    return "{ " + std::to_string(a) + ", " + std::to_string(b) + ", 0 }";
  };
  const double s = std::sin(angle), c = std::cos(angle);
  return "local particles = sim.particles { mass = 2 }\nparticles:add(" + text(0, height) +
         ", { velocity = " + text(speed * c, speed * s) +
         " })\nreturn sim.scene { particles = particles, forces = { sim.force.gravity { g = {0, "
         "-9.81, 0} } }, colliders = { sim.collider.plane { normal = " +
         text(-s, c) + ", " + plane + " } }, " + more +
         "integrator = 'rk4', dt = 0.01, duration = 1 }\n";
}

// The error of the way of a run at 0.2 s, while it slides, m.
double off(const std::string& text, const std::string& method, double dt) {
  TextRun run(text, method, dt);
  run.run_to(0.2);
  return std::fabs(run.system.position(0)[0] - way_at(0.2));
}

}  // namespace

TEST_CASE("viscoelastic restitution is that of an integrated blow") {
  // Hertz's force with the dissipation of Kuwabara and Kono, of the unit mass and stiffness:
  //   x'' = -max(0, x^(3/2) + A (3/2) sqrt(x) x'), from x = 0, x' = v until the force ends.
  const auto blow = [](double damping, double v) {
    double x = 0, u = v;
    const double h = 1e-4;
    const auto force = [&](double at, double rate) {
      return at > 0 ? -(at * std::sqrt(at) + 1.5 * damping * std::sqrt(at) * rate) : 0.0;
    };
    for (int n = 0; n < 400000; ++n) {
      const double k1 = force(x, u), l1 = u;
      const double k2 = force(x + 0.5 * h * l1, u + 0.5 * h * k1), l2 = u + 0.5 * h * k1;
      const double k3 = force(x + 0.5 * h * l2, u + 0.5 * h * k2), l3 = u + 0.5 * h * k2;
      const double k4 = force(x + h * l3, u + h * k3), l4 = u + h * k3;
      x += h / 6 * (l1 + 2 * l2 + 2 * l3 + l4);
      u += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
      if (u < 0 && force(x, u) >= 0) break;
    }
    return -u / v;
  };
  const double damping = 0.2;
  const auto law = make_law("viscoelastic", {{"restitution", blow(damping, 1)}});
  CHECK(law->restitution(1) == Approx(blow(damping, 1)).epsilon(1e-12));
  for (const double v : {0.01, 0.1, 0.5, 3.0, 10.0}) {
    INFO(v << " m/s");
    CHECK(law->restitution(v) == Approx(blow(damping, v)).margin(3e-3));
  }
  CHECK(law->restitution(0) == 1);
}

TEST_CASE("a ball bounces by a restitution that depends on its speed") {
  const auto law = make_law("viscoelastic", {{"restitution", 0.7}, {"speed", 2.0}});
  const std::string plane = "law = sim.law.viscoelastic { restitution = 0.7, speed = 2 }";
  // From 1 m, in free flights between blows.
  double v = std::sqrt(2 * kG), t = std::sqrt(2 / kG);
  for (int bounce = 0; bounce < 4; ++bounce) {
    const double after = law->restitution(v) * v;
    if (t + 2 * after / kG > 1.7) break;
    v = after;
    t += 2 * v / kG;
  }
  v *= law->restitution(v);
  const double since = 1.7 - t, height = v * since - 0.5 * kG * since * since;
  REQUIRE(height > 0.02);
  for (const char* method : {"verlet", "rk4", "dopri5"}) {
    INFO(method);
    TextRun run(particle(0, plane, 0, 1), method, 0.01);
    run.run_to(1.7);
    CHECK(run.system.position(0)[1] ==
          Approx(std::string(method) == "dopri5"
                     ? v * (run.system.t() - t) - 0.5 * kG * std::pow(run.system.t() - t, 2)
                     : height)
              .margin(1e-9));
  }
  // Implicit methods bounce at the moment that they find by rounds.
  TextRun run(particle(0, plane, 0, 1), "implicit_midpoint", 0.005);
  run.run_to(1.7);
  CHECK(run.system.position(0)[1] == Approx(height).margin(1e-6));
}

TEST_CASE("a particle slides as the closed form of Stribeck's friction says, with order 2") {
  const std::string text = particle(0, kStribeck, 1);
  for (const char* method : {"verlet", "rk4", "implicit_midpoint", "trbdf2"}) {
    INFO(method);
    const double coarse = off(text, method, 0.01), fine = off(text, method, 0.0025);
    CHECK(coarse < 2e-4);
    CHECK(fine < coarse / 11);
  }
  for (const char* method : {"symplectic_euler", "implicit_euler"}) {
    INFO(method);
    const double coarse = off(text, method, 0.01), fine = off(text, method, 0.0025);
    CHECK(coarse < 2e-2);
    CHECK(fine < coarse / 3);
  }
  // A method whose steps end at impacts keeps its own order.
  TextRun run(text, "dopri5", 0.01);
  run.run_to(0.2);
  CHECK(run.system.position(0)[0] == Approx(way_at(run.system.t())).margin(1e-8));
}

TEST_CASE("between static and kinetic friction what rests stays, and what slides goes on") {
  // tan(0.4) = 0.423 is between both.
  const double slope = 0.4, kinetic = kG * (std::sin(slope) - kKinetic * std::cos(slope));
  for (const char* method : {"verlet", "rk4", "implicit_euler", "implicit_midpoint", "dopri5"}) {
    INFO(method);
    TextRun rests(particle(slope, kStribeck, 0), method, 0.01);
    rests.run_to(0.5);
    CHECK(rests.system.position(0).norm() < 1e-6);
    TextRun slides(particle(slope, kStribeck, -3), method, 0.01);
    slides.run_to(0.5);
    CHECK(slides.system.velocity(0).norm() == Approx(3 + 0.5 * kinetic).epsilon(1e-4));
  }
}

TEST_CASE("what constraints join slides by the same law") {
  const std::string made =
      "local particles = sim.particles { mass = 1 }\n"
      "particles:add({0, 0, 0}, { velocity = {1, 0, 0} })\n"
      "particles:add({1, 0, 0}, { velocity = {1, 0, 0} })\n";
  const std::string text =
      scene(made,
            "particles = particles, constraints = { sim.constraint.distance { ties = { {0, "
            "1} } } }",
            kStribeck);
  for (const char* method : {"verlet", "rk4"}) {
    INFO(method);
    const double coarse = off(text, method, 0.01), fine = off(text, method, 0.0025);
    CHECK(coarse < 5e-3);
    CHECK(fine < coarse / 3);
  }
  TextRun run(text, "dopri5", 0.01);
  run.run_to(0.2);
  CHECK(run.system.position(0)[0] == Approx(way_at(run.system.t())).margin(1e-6));
}

TEST_CASE("bodies bounce and slide by the laws of both sides") {
  const auto law = make_law("viscoelastic", {{"restitution", 0.7}, {"speed", 2.0}});
  const std::string ball =
      "local b = sim.rigid { shape = sim.sphere { radius = 0.1 }, mass = 2, position = {0, 0.6, "
      "0}, law = sim.law.viscoelastic { restitution = 0.7, speed = 2 } }\n";
  TextRun falls(scene(ball, "bodies = { b }", "restitution = 0.1"), "verlet", 0.01);
  falls.run_to(0.4);
  const double v = std::sqrt(2 * kG * 0.5), since = falls.system.t() - v / kG;
  CHECK(falls.system.body_state(0).velocity[1] ==
        Approx(law->restitution(v) * v - kG * since).margin(1e-9));

  // A box, too long to tilt, that slides: the geometric mean of the same law on both sides.
  const std::string box =
      "local b = sim.rigid { shape = sim.box { half = {1, 0.05, 1} }, mass = 2, position = {0, "
      "0.05, 0}, velocity = {1, 0, 0}, " +
      kStribeck + " }\n";
  const auto slid = [&](double dt) {
    TextRun run(scene(box, "bodies = { b }", kStribeck), "verlet", dt);
    run.run_to(0.2);
    return std::fabs(run.system.body_state(0).center[0] - way_at(0.2));
  };
  const double coarse = slid(0.01), fine = slid(0.0025);
  CHECK(coarse < 5e-3);
  CHECK(fine < coarse / 3);
}

TEST_CASE("surfaces rub by a law") {
  // A sheet of 4 particles slides on a pinned one, both in mid air.
  const auto text = [](const std::string& law) {
    return "local particles = sim.particles { mass = 0.1 }\n"
           "local function quad(x, y, half, v)\n"
           "  local ids = {}\n"
           "  for _, at in ipairs { {-1, -1}, {1, -1}, {1, 1}, {-1, 1} } do\n"
           "    ids[#ids + 1] = particles:add({ x + half * at[1], y, half * at[2] }, { velocity = "
           "{v, 0, 0} })\n"
           "  end\n"
           "  return { {ids[1], ids[3], ids[2]}, {ids[1], ids[4], ids[3]} }, ids\n"
           "end\n"
           "local below, pinned = quad(0, 0, 1, 0)\n"
           "for _, id in ipairs(pinned) do particles:pin(id) end\n"
           "local above = quad(0, 0.0101, 0.2, 1)\n"
           "local lower = sim.surface { particles = particles, triangles = below }\n"
           "local upper = sim.surface { particles = particles, triangles = above }\n"
           "return sim.scene { particles = particles, contact = sim.contact { surfaces = { lower, "
           "upper }, thickness = 0.01, " +
           law +
           " }, forces = { sim.force.gravity { g = {0, -9.81, 0} } }, integrator = 'verlet', dt = "
           "0.001, duration = 1 }\n";
  };
  TextRun run(text(kStribeck), "verlet", 0.001);
  run.run_to(0.2);
  double speed = 0;
  for (int i = 4; i < 8; ++i) speed += 0.25 * run.system.velocity(i)[0];
  CHECK(speed == Approx(speed_at(0.2)).margin(0.03));
  CHECK(contains(said(text("law = sim.law.coulomb { restitution = 0.5 }")), "it bounces"));
  CHECK(contains(said(text("friction = 0.1, " + kStribeck)), "friction is given beside it"));
}

TEST_CASE("a law with constant numbers has the bits of these numbers") {
  for (const char* method : {"verlet", "implicit_midpoint"}) {
    TextRun law(particle(0.3, "law = sim.law.coulomb { friction = 0.2, restitution = 0.5 }", 1, 1),
                method, 0.01);
    TextRun numbers(particle(0.3, "friction = 0.2, restitution = 0.5", 1, 1), method, 0.01);
    law.run_to(1);
    numbers.run_to(1);
    CHECK(law.system.hash() == numbers.system.hash());
  }
}

TEST_CASE("contact by any law gives no energy") {
  const std::string both[] = {
      kStribeck, "law = sim.law.viscoelastic { restitution = 0.6, friction = 0.4 }",
      "law = sim.law.stribeck { static = 2, kinetic = 0.1, speed = 0.001, restitution = 0.9 }"};
  for (const std::string& law : both)
    for (const char* method :
         {"verlet", "rk4", "symplectic_euler", "implicit_euler", "implicit_midpoint"}) {
      INFO(law << ", " << method);
      TextRun run(particle(0.3, law, 2, 0.5), method, 0.01);
      study::EnergyBalance balance(run.system);
      double before = 0;
      for (int n = 0; n < 150; ++n) {
        REQUIRE(run.system.step());
        balance.advance();
        balance.look();
        CHECK(balance.contact().lost >= before - 1e-12);
        before = balance.contact().lost;
      }
      CHECK(before > 1);
    }
}

TEST_CASE("laws keep what their interface promises, and one that does not is found") {
  Registry registry({SIM_PLUGIN_DIR});
  const auto failed = [&](const PluginInfo& plugin) {
    study::Contract contract;
    study::check_contract(registry, plugin, contract);
    CHECK(contract.checks.size() > 6);
    std::set<std::string> names;
    for (const auto& check : contract.checks)
      if (check.outcome == study::Outcome::kFailed) names.insert(check.name);
    return names;
  };
  for (const char* name : {"coulomb", "stribeck", "viscoelastic"})
    CHECK(failed(registry.get<ContactLaw>(name)).empty());

  struct Bad final : ContactLaw {
    int fault;
    explicit Bad(int which) : fault(which) {}
    double restitution(double v) const override { return fault == 0 ? 1.1 : v > 1e4 ? 0 : 0.5; }
    double friction(double v) const override {
      if (fault == 1) return v > 0 ? 0.3 : 0;
      if (fault == 2) return v > 1 ? 0.3 : 0.5;
      return fault == 3 ? 0.3 + 0.1 / (1 + v) : 0.3;
    }
    bool constant() const override { return fault != 1 && fault != 2; }
  };
  const std::string faults[] = {"restitution is 0 .. 1, friction at least 0",
                                "is 0 at rest only where it is 0 at all speeds", "does not jump",
                                "says whether it depends on the speed"};
  for (int fault = 0; fault < 4; ++fault) {
    Plugin<ContactLaw> plugin{{.name = "bad"},
                              [fault](const Params&) { return std::make_unique<Bad>(fault); }};
    plugin.kind = kind_of<ContactLaw>;
    CHECK(failed(plugin) == std::set<std::string>{faults[fault]});
  }
}

TEST_CASE("laws are refused where they contradict what is said beside them") {
  CHECK(contains(said(particle(0, "friction = 0.1, " + kStribeck, 1)), "give either the law"));
  CHECK(contains(said("local b = sim.rigid { shape = sim.sphere { radius = 1 }, mass = 1, friction "
                      "= 0.1, " +
                      kStribeck + " }\n"),
                 "give either the law"));
  CHECK(contains(said("local b = sim.rigid { shape = sim.sphere { radius = 1 }, mass = 1, law = 3 }"
                      "\n"),
                 "sim.law.NAME"));
  CHECK(contains(said(particle(0, "law = sim.law.stribeck { static = 0.1, kinetic = 0.2 }", 1)),
                 "kinetic <= static"));
  CHECK(contains(
      said("local particles = sim.particles { mass = 1 }\nparticles:add {0, 1, 0}\n"
           "return sim.scene { particles = particles, forces = { sim.force.contact { "
           "collider = sim.collider.plane { " +
           kStribeck + " }, stiffness = 100 } }, integrator = 'rk4', dt = 0.01, duration = 1 }\n"),
      "leave `law` out"));
}
