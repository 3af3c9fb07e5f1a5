// A file from which a run goes on bit for bit.
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
    // Instead of x, to be written: the state of a simulation, which outlives this, and the places
    // in it of numbers that are written as 0, ascending.
    std::span<const double> live = {};
    std::vector<std::size_t> zeros = {};
    std::vector<int> broken = {};  // as in Settings
    double broken_energy = 0;      // J
  };
  std::string scene;                            // as it was asked for
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

// Puts the simulation where the checkpoint was made, with the integrator, step size and pins of
// then. Throws Error{kCheckpoint} when it is of another scene; then nothing has changed. A system
// without an identity may be of another scene with as many numbers.
void resume(Simulation& simulation, const SystemSpec& spec, const Checkpoint::System& saved,
            Registry& registry);

// Little-endian: magic, version, contents, hash of all before it; handed over in small blocks.
void encode(const Checkpoint& checkpoint, const std::function<void(std::string_view)>& sink);
std::string encode(const Checkpoint& checkpoint);

// Bytes with their hash behind them, as the end of a checkpoint.
std::string sealed(std::string_view bytes);

// By its first bytes.
bool looks_like_checkpoint(std::string_view bytes);

// Throws Error{kCheckpoint} for what is no checkpoint, cut off, damaged or of another version.
Checkpoint decode(std::string_view bytes, const std::string& file);

}  // namespace sim
