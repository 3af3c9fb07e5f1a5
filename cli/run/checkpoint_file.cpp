#include "cli/run/checkpoint_file.h"

#include <cmath>
#include <filesystem>
#include <fstream>

#include "core/base/error.h"
#include "core/base/finite.h"
#include "core/base/read_file.h"
#include "core/base/text.h"
#include "core/output/format.h"
#include "core/output/output.h"

namespace sim::cli {
namespace {

constexpr std::size_t kHead = 64;  // bytes

[[noreturn]] void refuse(const std::string& file, const std::string& why,
                         const std::string& remedy) {
  throw Error(ErrorKind::kCheckpoint, {"cannot resume", file, why, remedy});
}

Provenance provenance(const SceneRequest& request, const LoadedScene& scene) {
  return provenance_of(scene.spec, *scene.registry, request.seed, version_line());
}

// The reason why the steps before a checkpoint may differ from those the scene would make now.
std::string doubt_of(const Checkpoint& saved, const Provenance& now, const std::string& file) {
  if (!saved.provenance) return file + " does not say what it was made of (version 3)";
  const std::vector<std::string> changed = changes(*saved.provenance, now);
  const std::string& earlier = saved.provenance->doubt;
  if (changed.empty()) return earlier;
  return "changed since " + file + " was made: " + join(changed, "; ") +
         (earlier.empty() ? "" : "; before that, " + earlier);
}

}  // namespace

std::vector<Account> accounts_of(std::span<const Track> tracks) {
  std::vector<Account> accounts;
  for (const Track& track : tracks) {
    accounts.push_back({track.start_energy().total(), track.work_memory(), track.doubt()});
    // The work at an exploded state may be no number: it is unknown.
    std::vector<double>& work = accounts.back().work;
    if (!all_finite(work)) work.clear();
  }
  return accounts;
}

std::unique_ptr<Output> make_checkpoint(const std::string& file, const SceneRequest& request,
                                        const LoadedScene& scene, std::span<const Account> accounts,
                                        std::ostream& standard_output) {
  Checkpoint saved;
  saved.scene = request.scene;
  saved.settings = request.settings;
  saved.seed = request.seed;
  saved.provenance = provenance(request, scene);
  if (!accounts.empty()) saved.provenance->doubt = accounts.front().doubt;
  for (std::size_t i = 0; i < scene.systems.size(); ++i) {
    saved.systems.push_back(
        live_checkpoint(scene.systems[i], scene.spec.systems[i], accounts[i].start_energy));
    saved.systems.back().work = accounts[i].work;
  }
  auto output = std::make_unique<Output>(Target{file}, standard_output);
  encode(saved, [&](std::string_view block) {
    output->buffer() += block;
    output->flush_if_full();
  });
  return output;
}

void save_checkpoint(const std::string& file, const SceneRequest& request, const LoadedScene& scene,
                     std::span<const Account> accounts, std::ostream& standard_output) {
  make_checkpoint(file, request, scene, accounts, standard_output)->commit_safely();
}

Checkpoint read_checkpoint(const std::string& file) {
  constexpr const char* kRemedy = "give a file that --snap or .snap wrote";
  if (std::error_code failed; std::filesystem::is_other(file, failed))
    refuse(file, "it is not a checkpoint file, for it is not a regular file", kRemedy);
  // A file that is no checkpoint is not read to its end.
  check_input_file(file, HUGE_VAL, kRemedy);
  std::string head(kHead, '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(stream.gcount()));
  if (!looks_like_checkpoint(head)) return decode(head, file);
  return decode(read_input_file(file, most_of_memory(), kRemedy), file);
}

void complete(SceneRequest& request, const Checkpoint& saved) {
  request.settings.insert(saved.settings.begin(), saved.settings.end());
  if (request.seed == 0) request.seed = saved.seed;
}

std::vector<Account> resume_all(LoadedScene& scene, const SceneRequest& request,
                                const Checkpoint& saved, const std::string& file,
                                Registry& registry) {
  const auto& systems = saved.systems;
  if (systems.size() != scene.systems.size())
    refuse(file,
           "it has " + counted(static_cast<long>(systems.size()), "system") + ", the scene " +
               std::to_string(scene.systems.size()),
           "it was made of " + saved.scene);
  for (std::size_t i = 0; i < systems.size(); ++i) {
    const Simulation& system = scene.systems[i];
    if (systems[i].name != system.name())
      refuse(file, "it is of '" + systems[i].name + "', not of '" + system.name() + "'",
             "it was made of " + saved.scene);
    const MethodChoice& made_with = systems[i].integrator;
    if (request.integrator != MethodChoice() && system.method().choice() != made_with)
      refuse(file, "it was made with the integrator " + made_with.name + ", or other values for it",
             "leave --integrator and its options out");
    if (request.dt > 0 && request.dt != systems[i].h)
      refuse(file, "it was made with steps of " + brief(systems[i].h) + " s", "leave --dt out");
  }
  try {
    for (std::size_t i = 0; i < systems.size(); ++i)
      resume(scene.systems[i], scene.spec.systems[i], systems[i], registry);
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::kCheckpoint) throw;
    ErrorText text = error.text();
    text.where = file + ": " + text.where;
    text.remedy += "; it was made of " + saved.scene;
    throw Error(error.kind(), text);
  }
  const std::string doubt = doubt_of(saved, provenance(request, scene), file);
  std::vector<Account> accounts;
  for (const auto& system : systems) accounts.push_back({system.start_energy, system.work, doubt});
  return accounts;
}

}  // namespace sim::cli
