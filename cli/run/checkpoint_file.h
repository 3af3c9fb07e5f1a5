// Checkpoints as files: --snap, --resume, and the same of a session.
#pragma once

#include <memory>
#include <ostream>
#include <span>
#include <string>
#include <vector>

#include "cli/run/judged.h"
#include "cli/run/scene.h"
#include "core/output/output.h"
#include "core/session/checkpoint.h"

namespace sim::cli {

// From where the drift of a system counts, and what has been taken since.
struct Account {
  double start_energy = 0;   // J
  std::vector<double> work;  // WorkIntegral::memory(); empty: not known
  std::string doubt = {};    // why a verdict cannot trust the steps before; empty: it can
};

std::vector<Account> accounts_of(std::span<const Track> tracks);

// To a file that is not there until commit_safely(); one account a system. Throws Error{kIo}.
std::unique_ptr<Output> make_checkpoint(const std::string& file, const SceneRequest& request,
                                        const LoadedScene& scene, std::span<const Account> accounts,
                                        std::ostream& standard_output);

// Replaces the file as a whole. Throws Error{kIo}.
void save_checkpoint(const std::string& file, const SceneRequest& request, const LoadedScene& scene,
                     std::span<const Account> accounts, std::ostream& standard_output);

// Throws Error{kIo} for a file that cannot be read, Error{kCheckpoint} for one that is no good.
Checkpoint read_checkpoint(const std::string& file);

// Fills in what the request leaves open with the settings that the checkpoint was made with.
void complete(SceneRequest& request, const Checkpoint& saved);

// Puts all systems where they were, and returns their accounts. Throws Error{kCheckpoint} when they
// are others, or when the request asks for another integrator or step size.
std::vector<Account> resume_all(LoadedScene& scene, const SceneRequest& request,
                                const Checkpoint& saved, const std::string& file,
                                Registry& registry);

}  // namespace sim::cli
