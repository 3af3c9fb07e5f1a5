#include "cli/verbs/sweep_key.h"

#include <dlfcn.h>

#include <algorithm>

#include "core/base/md5.h"
#include "core/session/identity.h"

namespace sim {

template <>
struct FieldsOf<MethodChoice> {
  static constexpr StructField list[] = {{"name"}, {"given"}};
};

template <>
struct FieldsOf<Threads> {
  static constexpr StructField list[] = {{"most"}, {"as_pay"}};
};

template <>
struct FieldsOf<LuaLimits> {
  static constexpr StructField list[] = {
      {"seconds"}, {"memory"}, {"steps"}, {"seconds_in_all"}, {"steps_in_all"}};
};

template <>
struct FieldsOf<cli::SceneRequest> {
  static constexpr StructField list[] = {
      {"scene"}, {"settings"},   {"off"},         {"without"},
      {"seed"},  {"integrator"}, {"dt"},          {"threads", false},  // rows do not depend on it
      {"lua"},   {"safe"},       {"plugin_path"}, {"libraries"}};
};

template <>
struct FieldsOf<cli::RunLength> {
  static constexpr StructField list[] = {{"time"}, {"steps"}};
};

template <>
struct FieldsOf<report::Checks> {
  static constexpr StructField list[] = {{"energy"}, {"strain"}, {"dt"}, {"verified"}};
};

template <>
struct FieldsOf<cli::CaseRun> {
  static constexpr StructField list[] = {{"scene"}, {"length"}, {"checks"}, {"verify"}, {"of"}};
};

template <>
struct FieldsOf<cli::Environment> {
  static constexpr StructField list[] = {{"plugin_folders"}, {"scene_folders"}};
};

namespace cli {
namespace {

// The program and the kernel, as they are on disk.
std::uint64_t program_hash() {
  StateHash hash;
  hash.add(content_hash_of("/proc/self/exe"));
  Dl_info kernel;
  if (::dladdr(reinterpret_cast<const void*>(&md5), &kernel) != 0 && kernel.dli_fname)
    hash.add(content_hash_of(kernel.dli_fname));
  return hash.value();
}

}  // namespace

std::uint64_t program_key(const Environment& environment) {
  StateHash key;
  key.add(digest(environment));
  key.add(digest(version_line()));
  key.add(program_hash());
  return key.value();
}

std::uint64_t request_key(CaseRun run, const std::string& scene) {
  run.scene.scene = std::filesystem::absolute(scene).string();
  return digest(run);
}

const InputFile* FileContents::changed(const std::vector<InputFile>& files) {
  const auto found = std::ranges::find_if(files, [&](const InputFile& file) {
    const auto [known, is_new] = known_.emplace(file.path, 0);
    if (is_new) known->second = content_hash_of(file.path);
    return known->second != file.hash;
  });
  return found == files.end() ? nullptr : &*found;
}

}  // namespace cli
}  // namespace sim
