// Checkpoints: files from which a run continues bit for bit.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/scene/simulation.h"
#include "core/session/identity.h"
#include "core/session/provenance.h"

namespace sim {

struct Checkpoint {
  struct System {
    std::string name;
    SceneIdentity identity;
    MethodChoice integrator;
    double h = 0, t0 = 0;  // s
    std::int64_t step = 0, n0 = 0;
    double start_energy = 0;  // J, from where the drift counts
    std::vector<int> pinned;
    std::vector<std::string> off;  // switches
    std::vector<double> x, memory;
    std::vector<double> work;  // WorkIntegral::memory(); empty: not known
    // Replaces x when writing: the state of a simulation, which outlives this, and the indices of
    // numbers that are written as 0, ascending.
    std::span<const double> live = {};
    std::vector<std::size_t> zeros = {};
    std::vector<int> broken = {};  // as in Settings
    double broken_energy = 0;      // J
  };
  std::string scene;                            // as requested
  std::map<std::string, std::string> settings;  // --set
  std::uint64_t seed = 0;
  std::vector<System> systems;
  std::optional<Provenance> provenance = {};  // none, nor identities, in files of version 3
};

Checkpoint::System checkpoint(const Simulation& simulation, const SystemSpec& spec,
                              double start_energy);

// The same for encode() alone, without a copy of the state.
Checkpoint::System live_checkpoint(const Simulation& simulation, const SystemSpec& spec,
                                   double start_energy);

// Restores the simulation at the checkpoint, with its integrator, step size and pins. Throws
// Error{kCheckpoint} if it is of another scene; then nothing has changed. A system without an
// identity may be of another scene with as many numbers.
void resume(Simulation& simulation, const SystemSpec& spec, const Checkpoint::System& saved,
            Registry& registry);

// Little-endian: magic, version, contents, hash of all before it; passed on in small blocks.
void encode(const Checkpoint& checkpoint, const std::function<void(std::string_view)>& sink);
std::string encode(const Checkpoint& checkpoint);

// Bytes followed by their hash, as at the end of a checkpoint.
std::string sealed(std::string_view bytes);

// True by its first bytes.
bool looks_like_checkpoint(std::string_view bytes);

// Throws Error{kCheckpoint} for data that is no checkpoint, truncated, damaged or of another
// version.
Checkpoint decode(std::string_view bytes, const std::string& file);

}  // namespace sim
