// Scenes that many tests use, as plain data. SI units throughout.
#pragma once

#include <string>

#include "core/plugin/registry.h"
#include "core/scene/scene_spec.h"
#include "core/scene/simulation.h"

namespace sim_test {

inline constexpr double kGravity = 9.81;  // m/s^2, downwards along y

// The plugins of this build.
sim::Registry make_registry();

sim::PartSpec make_part(const std::string& plugin, std::map<std::string, sim::Value> given = {});
sim::PartSpec make_gravity();
sim::PartSpec make_drag(double k);
// An empty family of springs, to be tied.
sim::PartSpec make_springs(const std::string& family, double stiffness);

struct ClothOptions {
  bool gravity = true, pinned = true;
  double drag = 2;  // times the mass of one particle, in kg/s; 0 = none
};
// The n x n cloth of 1 m and 1 kg: particle i * n + j at (j / n, 0, i / n), ends of row 0 pinned.
sim::SystemSpec make_cloth(int n, const ClothOptions& options = {});

// x' = (-y, x, 0) from (1, 0, 0).
sim::SystemSpec make_circle();

// One particle of 1 kg at (0, -1, 0) on a spring (49 N/m, rest 1 m) to the origin.
sim::SystemSpec make_vertical_spring(double drag);

// One particle of 1 kg on a spring (40 N/m, rest 1 m) to the origin, in general position, moving.
sim::SystemSpec make_elastic_pendulum(double drag = 0);

// Particles of 0.25 kg at the points given, consecutive ones tied by springs of 400 N/m and rest
// length 0.25 m, under gravity.
sim::SystemSpec make_chain(const std::vector<sim::Vec3>& points, std::vector<int> pinned,
                           double drag);

// The linear chain of linear_chain.csv: 10 particles of 0.1 kg, 1 m apart along x between two
// pinned ones, springs of 100 N/m at rest length; displaced along x by amplitude * sin(mode j pi /
// 11).
sim::SystemSpec make_row(int mode = 1, double amplitude = 0);

// One free particle of `mass` kg under gravity.
sim::SystemSpec make_falling(double mass, double drag);

// One particle of 1 kg and one collider.
sim::SystemSpec make_particle(const sim::Vec3& position, const sim::Vec3& velocity,
                              sim::PartSpec collider, bool gravity = true);
sim::PartSpec make_sphere(double friction = 0);               // of 1 m about the origin
sim::PartSpec make_slope(double angle, double friction = 0);  // a plane that rises along x

sim::SystemSpec make_lorenz();  // x' = 10 (y - x) and so on: chaos, Lorenz (1963)

// With the defaults of its parameters.
sim::IntegratorInfo info_of(const std::string& integrator, sim::Registry& registry);

// Runs with the named method in fixed steps of dt, whether it could choose its own or not.
sim::RunOptions fixed_steps(const std::string& integrator, double dt, sim::Registry& registry);

// The methods that can run the scene, by name; with an order of their own: without those that
// choose among the others.
std::vector<std::string> methods_for(const sim::SystemSpec& spec, sim::Registry& registry);
std::vector<std::string> methods_with_order(const sim::SystemSpec& spec, sim::Registry& registry);

// Takes n steps; false as soon as one fails.
bool run(sim::Simulation& simulation, std::int64_t n);

// Positions and velocities of all particles (or the components) one after the other.
std::vector<double> state_of(const sim::Simulation& simulation);

// True when both states agree bit for bit.
bool same_bits(const std::vector<double>& a, const std::vector<double>& b);

// A figure that the corrections of steps account for, their sum; fails where none of them does.
double figure_of(const sim::Simulation& simulation, const std::string& name);

}  // namespace sim_test
