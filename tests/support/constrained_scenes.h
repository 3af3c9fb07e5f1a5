// Scenes of particles on rods that meet colliders.
#pragma once

#include <cmath>
#include <cstdio>
#include <string>

namespace sim::test {

inline constexpr double kG = 9.81;

inline std::string held_scene(const std::string& points, const std::string& ties,
                              const std::string& collider, const std::string& more = "") {
  return "local p = sim.particles { mass = 2 }\nfor _, x in ipairs { " + points +
         " } do p:add(x) end\n" + more +
         "\nreturn sim.scene { particles = p, forces = { sim.force.gravity { g = {0, -9.81, 0} } },"
         " constraints = { sim.constraint.distance { ties = { " +
         ties + " } } }, colliders = { " + collider +
         " }, integrator = 'rk4', dt = 0.01, duration = 1 }\n";
}

inline const std::string kFloor = "sim.collider.plane { restitution = 0.5 }";
inline const std::string kSmooth = "sim.collider.plane {}";

// Both ends lie in a sphere of 1 m, 30 and 90 degrees from its lowest point.
inline std::string bowl(const std::string& friction) {
  return held_scene(
      "{0.5, -0.8660254037844387, 0}, {1, 0, 0}", "{0, 1}",
      "sim.collider.sphere { radius = 1, inside = true, friction = " + friction + " }");
}

// A rope of so many links half around a cylinder of 0.3 m; what follows its last particle.
inline std::string rope(int links, const std::string& friction, const std::string& last,
                        const std::string& more = "") {
  std::string points, ties;
  for (int i = 0; i <= links; ++i) {
    const double a = M_PI * i / links;
    char text[100];
    std::snprintf(text, sizeof text, "{%.17g, %.17g, 0}, ", -0.3 * std::cos(a), 0.3 * std::sin(a));
    points += text;
    if (i > 0) ties += "{" + std::to_string(i - 1) + ", " + std::to_string(i) + "}, ";
  }
  if (!last.empty()) {
    points += last;
    ties += "{" + std::to_string(links) + ", " + std::to_string(links + 1) + "}";
  }
  return held_scene(points, ties,
                    "sim.collider.capsule { a = {0, 0, -1}, b = {0, 0, 1}, radius = 0.3, friction "
                    "= " +
                        friction + " }",
                    more);
}

// A sheet of 8 x 8 rods above a ball of 0.3 m, and other colliders.
inline std::string sheet(const std::string& others) {
  return "local c = sim.grid { 8, 8, origin = {-0.4, 0.06, -0.43}, du = {0, 0, 0.11}, dv = {0.11, "
         "0, 0}, mass = 0.01 }\n"
         "return sim.scene { particles = c, forces = { sim.force.gravity { g = {0, -9.81, 0} },"
         " sim.force.spring { family = 'shear', stiffness = 2, grid = c, offsets = {{1,1},{1,-1}} }"
         " }, constraints = { sim.constraint.distance { grid = c, offsets = {{0,1},{1,0}} } },"
         " colliders = { sim.collider.sphere { radius = 0.3, center = {0, -0.3, 0}, friction = 0.4 "
         "}, " +
         others + " }, integrator = 'verlet', dt = 0.004, duration = 1 }\n";
}

}  // namespace sim::test
