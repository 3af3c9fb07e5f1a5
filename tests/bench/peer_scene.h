// The scene as plain text for other programs; they read it with tests/bench/peers/peer.h.
#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include "core/scene/scene_spec.h"
#include "core/scene/simulation.h"

namespace sim_bench {

// Springs are taken from the compiled simulation, particles, gravity and drag from the
// specification it was compiled from, the step from the simulation. Throws sim::Error{kIo} when the
// file cannot be written.
void write_scene(const std::filesystem::path& path, const sim::SystemSpec& spec,
                 const sim::Simulation& simulation);

// The triangles of surfaces that may not pass through themselves; none without contact.
std::vector<std::array<int, 3>> triangles_in_contact(const sim::SystemSpec& spec);

// Cubes on the plane y = 0 instead, at rest.
struct Cubes {
  std::vector<sim::Vec3> centers;                  // m
  double half = 0, mass = 0, friction = 0, h = 0;  // m, kg, 1, s
};
void write_cubes(const std::filesystem::path& path, const Cubes& cubes);

}  // namespace sim_bench
