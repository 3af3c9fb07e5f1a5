// Checkpoints as files: --snap, --resume, and those of a session.
#pragma once

#include <memory>
#include <ostream>
#include <span>
#include <string>
#include <vector>

#include "cli/run/judged.h"
#include "cli/run/scene.h"
#include "core/output/output.h"
#include "core/report/checkpoint_file.h"

namespace sim::cli {

using report::Account, report::accounts_of, report::read_checkpoint;

report::CheckpointOrigin origin_of(const SceneRequest& request);

// Writes to a file that does not exist until commit_safely(); one account a system. Throws
// Error{kIo}.
std::unique_ptr<Output> make_checkpoint(const std::string& file, const SceneRequest& request,
                                        const LoadedScene& scene, std::span<const Account> accounts,
                                        std::ostream& standard_output);

// Replaces the file as a whole. Throws Error{kIo}.
void save_checkpoint(const std::string& file, const SceneRequest& request, const LoadedScene& scene,
                     std::span<const Account> accounts, std::ostream& standard_output);

// Completes the request with the settings of the checkpoint.
void complete(SceneRequest& request, const Checkpoint& saved);

// Restores all systems, and returns their accounts. Throws Error{kCheckpoint} if they are others,
// or if the request has another integrator or step size.
std::vector<Account> resume_all(LoadedScene& scene, const SceneRequest& request,
                                const Checkpoint& saved, const std::string& file,
                                Registry& registry);

}  // namespace sim::cli
