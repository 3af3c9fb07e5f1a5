#include "cli/run/checkpoint_file.h"

#include "core/base/error.h"
#include "core/output/format.h"

namespace sim::cli {

report::CheckpointOrigin origin_of(const SceneRequest& request) {
  return {request.scene, request.settings, request.seed, version_line()};
}

std::unique_ptr<Output> make_checkpoint(const std::string& file, const SceneRequest& request,
                                        const LoadedScene& scene, std::span<const Account> accounts,
                                        std::ostream& standard_output) {
  return report::make_checkpoint(file, origin_of(request), scene, *scene.registry, accounts,
                                 standard_output);
}

void save_checkpoint(const std::string& file, const SceneRequest& request, const LoadedScene& scene,
                     std::span<const Account> accounts, std::ostream& standard_output) {
  make_checkpoint(file, request, scene, accounts, standard_output)->commit_safely();
}

void complete(SceneRequest& request, const Checkpoint& saved) {
  request.settings.insert(saved.settings.begin(), saved.settings.end());
  if (request.seed == 0) request.seed = saved.seed;
}

std::vector<Account> resume_all(LoadedScene& scene, const SceneRequest& request,
                                const Checkpoint& saved, const std::string& file,
                                Registry& registry) {
  const auto refuse = [&](const std::string& why, const std::string& remedy) {
    throw Error(ErrorKind::kCheckpoint, {"cannot resume", file, why, remedy});
  };
  for (std::size_t i = 0; i < std::min(saved.systems.size(), scene.systems.size()); ++i) {
    if (saved.systems[i].name != scene.systems[i].name()) break;  // it is of another scene
    const MethodChoice& made_with = saved.systems[i].integrator;
    const double h = saved.systems[i].h;
    if (request.integrator != MethodChoice() && scene.systems[i].method().choice() != made_with)
      refuse("it was made with the integrator " + made_with.name + ", or other values for it",
             "leave --integrator and its options out");
    if (request.dt > 0 && request.dt != h)
      refuse("it was made with steps of " + brief(h) + " s", "leave --dt out");
  }
  return report::resume_all(scene, origin_of(request), saved, file, registry);
}

}  // namespace sim::cli
