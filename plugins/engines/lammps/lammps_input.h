// A scene as the input of LAMMPS: Thompson et al. (2022), Comput. Phys. Commun. 271, 108171.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "core/engine/engine.h"

namespace sim::engine {

// The files of a folder: `lmp -in scene.in`, started there, reads the next two and writes the last
// two. LAMMPS knows no units of ours but "si".
inline constexpr const char* kLammpsScript = "scene.in";
inline constexpr const char* kLammpsData = "scene.data";
inline constexpr const char* kLammpsMoments = "moments.txt";
inline constexpr const char* kLammpsFrames = "frames.bin";
inline constexpr const char* kLammpsLog = "log.lammps";

// The columns of numbers: `id x y z vx vy vz fx fy fz`, ids from 1.
inline constexpr int kLammpsColumns = 10;

// Writes the files, each whole or not at all; the script last. `moments`, ascending, are the steps
// of which there will be a frame, the present one first and the end last. Throws Error{kIo}, and
// Error{kScene} for what would take too much memory there.
void write_lammps(const Exchange& scene, std::span<const std::int64_t> moments,
                  const std::string& folder);

}  // namespace sim::engine
