// Checkpoints as files, from which scenes go on bit for bit with the books of their runs.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <ostream>
#include <span>
#include <string>
#include <vector>

#include "core/output/output.h"
#include "core/session/checkpoint.h"
#include "core/study/run/track.h"
#include "core/study/study.h"

namespace sim::report {

// From where the drift of a system counts, and what has been taken since.
struct Account {
  double start_energy = 0;   // J
  std::vector<double> work;  // WorkIntegral::memory(); empty: not known
  std::string doubt = {};    // why a verdict cannot trust the steps before; empty: it can
};

std::vector<Account> accounts_of(std::span<const study::Track> tracks);

// The scene as it was asked for, and the program that asks.
struct CheckpointOrigin {
  std::string scene;
  std::map<std::string, std::string> settings;
  std::uint64_t seed = 0;
  std::string program;  // program_line()
};

// To a file that is not there until commit_safely(); one account a system. Throws Error{kIo}.
std::unique_ptr<Output> make_checkpoint(const std::string& file, const CheckpointOrigin& origin,
                                        const StudiedScene& scene, const Registry& registry,
                                        std::span<const Account> accounts,
                                        std::ostream& standard_output);

// Throws Error{kIo} for a file that cannot be read, Error{kCheckpoint} for one that is no good.
Checkpoint read_checkpoint(const std::string& file);

// Puts all systems where they were, and returns their accounts. Throws Error{kCheckpoint} when they
// are others.
std::vector<Account> resume_all(StudiedScene& scene, const CheckpointOrigin& origin,
                                const Checkpoint& saved, const std::string& file,
                                Registry& registry);

// The version of a program, the commit and the compiler that it was built from, and what it runs
// on: "sim 0.2.0 (commit .., GNU 12.2.0, plugin ABI 30, avx2)".
std::string program_line(const std::string& version, const std::string& commit,
                         const std::string& compiler);

}  // namespace sim::report
