// The scene as plain text for other programs; they read it with tests/bench/peers/peer.h.
#pragma once

#include <filesystem>

#include "core/scene/scene_spec.h"
#include "core/scene/simulation.h"

namespace sim_bench {

// Springs are taken from the compiled simulation, particles, gravity and drag from the
// specification it was compiled from, the step from the simulation. Throws sim::Error{kIo} when the
// file cannot be written.
void write_scene(const std::filesystem::path& path, const sim::SystemSpec& spec,
                 const sim::Simulation& simulation);

}  // namespace sim_bench
