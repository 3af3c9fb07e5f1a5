#include "cli/verbs/test_plugin.h"

#include <dlfcn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "cli/run/environment.h"
#include "core/base/error.h"
#include "core/output/format.h"
#include "core/output/stream.h"
#include "core/plugin/library.h"
#include "core/plugin/probe.h"
#include "core/simd/simd_targets.h"
#include "core/study/contract/contract.h"

namespace sim::cli {
namespace {

using study::Contract;
using study::Outcome;

// The plugins that the library brings.
std::vector<const PluginInfo*> plugins_of(const std::filesystem::path& library,
                                          Registry& registry) {
  registry.load(library);
  std::vector<const PluginInfo*> plugins;
  for (const PluginKind& kind : kPluginKinds)
    for (const std::string& name : registry.names(kind)) {
      const PluginInfo& plugin = registry.get(kind, name);
      std::error_code differs;
      if (std::filesystem::equivalent(plugin.file, library, differs)) plugins.push_back(&plugin);
    }
  return plugins;
}

std::function<long()> allocation_count() {
  return reinterpret_cast<long (*)()>(dlsym(RTLD_DEFAULT, "sim_allocations"));
}

// Starts this program again with the library before the C library that counts allocations; goes on
// without it where that cannot be done.
void start_again_counting() {
  constexpr const char* kPreload = "LD_PRELOAD";
  if (allocation_count() || std::getenv(kPreload)) return;
  std::error_code none;
  const std::filesystem::path library = helper_file("count_allocations.so");
  if (!std::filesystem::exists(library, none)) return;
  std::ifstream file("/proc/self/cmdline", std::ios::binary);
  std::string words((std::istreambuf_iterator<char>(file)), {});
  std::vector<char*> arguments;
  for (std::size_t at = 0; at < words.size(); at = words.find('\0', at) + 1)
    arguments.push_back(words.data() + at);
  arguments.push_back(nullptr);
  setenv(kPreload, library.c_str(), 1);
  execv("/proc/self/exe", arguments.data());
  unsetenv(kPreload);
}

Contract contract_of(const std::filesystem::path& library, Registry& registry) {
  Contract contract;
  contract.allocations = allocation_count();
  for (const PluginInfo* plugin : plugins_of(library, registry))
    study::check_contract(registry, *plugin, contract);
  return contract;
}

// The bits with another instruction set, found by a child process in which the library has not been
// opened yet.
std::optional<std::uint64_t> bits_with(SimdLevel level, const std::filesystem::path& library,
                                       Registry& registry) {
  int ends[2];
  if (pipe(ends) != 0) return {};
  const pid_t child = fork();
  if (child == 0) {
    setenv("SIM_SIMD", simd_name(level), 1);
    bool told = false;
    try {
      const std::uint64_t bits = contract_of(library, registry).bits;
      told = write(ends[1], &bits, sizeof bits) == sizeof bits;
    } catch (const std::exception&) {
      told = false;
    }
    _exit(told ? 0 : 1);
  }
  close(ends[1]);
  std::uint64_t bits = 0;
  const bool told = child > 0 && read(ends[0], &bits, sizeof bits) == sizeof bits;
  close(ends[0]);
  if (child > 0) waitpid(child, nullptr, 0);
  return told ? std::optional(bits) : std::nullopt;
}

const char* word(Outcome outcome) {
  constexpr const char* kWords[] = {"ok", "FAILED", "skipped"};
  return kWords[static_cast<int>(outcome)];
}

std::string text_of(const Contract& contract) {
  std::vector<std::vector<std::string>> rows;
  std::string text, plugin;
  const auto close = [&] {
    if (!rows.empty()) text += plugin + '\n' + aligned(rows);
    rows.clear();
  };
  for (const auto& check : contract.checks) {
    if (check.plugin != plugin) close();
    plugin = check.plugin;
    rows.push_back({word(check.outcome), check.name, check.words});
  }
  close();
  return text;
}

}  // namespace

int test_plugin(const TestRequest& request, Registry& registry, Console& console) {
  const std::filesystem::path library = std::filesystem::absolute(request.library);
  read_card(library);
  probe_library(library);
  start_again_counting();
  constexpr double kLongest = 600;  // s, of all checks
  if (const auto why = tried_by_child([&] { contract_of(library, registry); }, kLongest);
      !why.empty())
    throw Error(ErrorKind::kPlugin, {"plugin", library.string(), why + " in the checks",
                                     "it was tried in a process of its own; mend it"});
  const SimdLevel best = simd_level();
  std::vector<std::pair<SimdLevel, std::optional<std::uint64_t>>> lower;
  for (const SimdLevel level : simd_levels())
    if (level < best) lower.emplace_back(level, bits_with(level, library, registry));

  Contract contract = contract_of(library, registry);
  std::string other;
  for (const auto& [level, bits] : lower)
    if (!bits || *bits != contract.bits)
      other += (other.empty() ? "" : ", ") + std::string(simd_name(level));
  const std::string all = "the same bits on every instruction set";
  const std::string name = "library " + library.filename().string();
  if (lower.empty())
    contract.checks.push_back({name, all, Outcome::kSkipped, "the machine has one"});
  else if (other.empty())
    contract.checks.push_back({name, all, Outcome::kOk, std::string("up to ") + simd_name(best)});
  else
    contract.checks.push_back({name, all, Outcome::kFailed, "others with " + other});

  const bool sealed = check_seal(library) == Seal::kWhole;
  contract.checks.push_back({name, "carries a checksum of its file",
                             sealed ? Outcome::kOk : Outcome::kSkipped,
                             sealed ? ""
                                    : "it has none: damage will not be noticed; sim_add_plugin "
                                      "of CMake makes one"});

  long failed = 0;
  std::vector<std::string> objects;
  for (const auto& check : contract.checks) {
    failed += check.outcome == Outcome::kFailed;
    objects.push_back(JsonObject()
                          .text("plugin", check.plugin)
                          .text("check", check.name)
                          .text("outcome", word(check.outcome))
                          .text("words", check.words)
                          .str());
  }
  if (request.json)
    put(console.out, JsonObject()
                             .text("library", library.string())
                             .flag("ok", failed == 0)
                             .json("checks", json_array(objects))
                             .str() +
                         '\n');
  else
    put(console.out, text_of(contract));
  flush_or_throw(console.out, "standard output");
  if (failed == 0) return 0;
  print_error(console.err, "the plugin breaks its contract: " + library.string() + ": " +
                               std::to_string(failed) + (failed == 1 ? " check" : " checks") +
                               " failed; see the lines marked FAILED");
  return static_cast<int>(ErrorKind::kPlugin);
}

}  // namespace sim::cli
