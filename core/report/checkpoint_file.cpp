#include "core/report/checkpoint_file.h"

#include <cmath>
#include <filesystem>
#include <fstream>

#include "core/base/error.h"
#include "core/base/finite.h"
#include "core/base/text.h"
#include "core/output/format.h"
#include "core/output/read_file.h"
#include "core/plugin/plugin.h"
#include "core/report/study_words.h"
#include "core/simd/simd_targets.h"

namespace sim::report {
namespace {

constexpr std::size_t kHead = 64;  // bytes

[[noreturn]] void refuse_checkpoint(const std::string& file, const std::string& why,
                                    const std::string& remedy) {
  throw Error(ErrorKind::kCheckpoint, {"cannot resume", file, why, remedy});
}

// Why the steps before a checkpoint may be others than the scene would make now.
std::string doubt_of(const Checkpoint& saved, const Provenance& now, const std::string& file) {
  if (!saved.provenance) return file + " does not say what it was made of (version 3)";
  const std::vector<std::string> changed = changes(*saved.provenance, now);
  const std::string& earlier = saved.provenance->doubt;
  if (changed.empty()) return earlier;
  return "changed since " + file + " was made: " + join(changed, "; ") +
         (earlier.empty() ? "" : "; before that, " + earlier);
}

}  // namespace

std::vector<Account> accounts_of(std::span<const study::Track> tracks) {
  std::vector<Account> accounts;
  for (const study::Track& track : tracks) {
    accounts.push_back({track.start_energy().total(), track.work_memory(), track.doubt()});
    // Work of a state that has exploded may be no number: it is not known.
    std::vector<double>& work = accounts.back().work;
    if (!all_finite(work)) work.clear();
  }
  return accounts;
}

std::unique_ptr<Output> make_checkpoint(const std::string& file, const CheckpointOrigin& origin,
                                        const StudiedScene& scene, const Registry& registry,
                                        std::span<const Account> accounts,
                                        std::ostream& standard_output) {
  Checkpoint saved;
  saved.scene = origin.scene;
  saved.settings = origin.settings;
  saved.seed = origin.seed;
  saved.provenance = provenance_of(scene.spec, registry, origin.seed, origin.program);
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

Checkpoint read_checkpoint(const std::string& file) {
  constexpr const char* kRemedy = "give a file that --snap or .snap wrote";
  if (std::error_code failed; std::filesystem::is_other(file, failed))
    refuse_checkpoint(file, "it is not a checkpoint file, for it is not a regular file", kRemedy);
  // A file that is no checkpoint is not read to its end.
  check_input_file(file, HUGE_VAL, kRemedy);
  std::string head(kHead, '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(stream.gcount()));
  if (!looks_like_checkpoint(head)) return decode(head, file);
  return decode(read_input_file(file, most_of_memory(), kRemedy), file);
}

std::vector<Account> resume_all(StudiedScene& scene, const CheckpointOrigin& origin,
                                const Checkpoint& saved, const std::string& file,
                                Registry& registry) {
  const auto& systems = saved.systems;
  if (systems.size() != scene.systems.size())
    refuse_checkpoint(file,
                      "it has " + counted(static_cast<long>(systems.size()), "system") +
                          ", the scene " + std::to_string(scene.systems.size()),
                      "it was made of " + saved.scene);
  for (std::size_t i = 0; i < systems.size(); ++i) {
    const Simulation& system = scene.systems[i];
    if (systems[i].name != system.name())
      refuse_checkpoint(file, "it is of '" + systems[i].name + "', not of '" + system.name() + "'",
                        "it was made of " + saved.scene);
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
  const std::string doubt =
      doubt_of(saved, provenance_of(scene.spec, registry, origin.seed, origin.program), file);
  std::vector<Account> accounts;
  for (const auto& system : systems) accounts.push_back({system.start_energy, system.work, doubt});
  return accounts;
}

std::string program_line(const std::string& version, const std::string& commit,
                         const std::string& compiler) {
  return "sim " + version + " (commit " + commit + ", " + compiler + ", plugin ABI " +
         std::to_string(kPluginAbi) + ", " + simd_name(simd_level()) + ")";
}

}  // namespace sim::report
