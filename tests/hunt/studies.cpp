#include "tests/hunt/studies.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <iomanip>
#include <iostream>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/study/accuracy/trajectory.h"
#include "tests/hunt/kinds.h"
#include "tests/support/scenes.h"

namespace sim_test {
namespace {

constexpr unsigned kMostSeconds = 5;  // of a study
constexpr const char* kStudies[] = {"tradeoff", "order", "compare", "stability",
                                    "minimal",  "rest",  "sweep"};

// A parameter, and a quantity to look at.
std::string with_argument(std::string text) {
  const std::string argument = "sim.arg('heavy', 1, 'a factor')";
  const bool flat = text.find("all.state") != std::string::npos;
  for (const std::string before : {"mass = ", "density = "}) {
    const std::size_t at = text.find(before);
    if (flat || at == std::string::npos) continue;
    text.insert(at + before.size(), argument + " * ");
    break;
  }
  std::string more =
      std::string("all.observe = { seen = function(s) ") +
      (flat ? "return s:component(0)" : "local _, kinetic = s:energy() return kinetic") +
      " end }\n";
  if (flat) more += "all.integrator, all.state[1] = 'rk4', " + argument + " * all.state[1]\n";
  text.insert(text.rfind("return sim.scene"), more);
  return text;
}

}  // namespace

StudiedScene::StudiedScene(std::uint64_t seed, sim::Registry& registry,
                           std::map<std::string, ClaimTally>& all, std::ostream& out)
    : seed_(seed), registry_(registry), all_(all), out_(out), random_(seed + 2'000'003) {
  const HuntKind& kind = hunt_kinds()[seed % hunt_kinds().size()];
  kind_ = kind.name;
  text_ = with_argument(kind.scene(seed));
  file_ =
      std::filesystem::temp_directory_path() / ("hunt_" + kind_ + std::to_string(seed) + ".lua");
  write_text(file_, text_);
  spec_ = system_of(text_, registry);
  for (const std::string& method : methods_for(spec_, registry))
    if (method != "auto" && can_run(spec_, method, registry)) methods_.push_back(method);
}

StudiedScene::~StudiedScene() { std::filesystem::remove(file_); }

Outcome limited_run(const std::vector<std::string>& words) {
  // A limit on the processor's time, which other programs do not use up.
  std::vector<std::string> all{
      "-c", "ulimit -t " + std::to_string(kMostSeconds) + "; exec \"$0\" \"$@\"", SIM_BINARY};
  all.insert(all.end(), words.begin(), words.end());
  return run_sim(all,
                 {.program = "/bin/sh", .environment = {{"SIM_PATH", SIM_SOURCE_DIR "/scripts"}}});
}

std::optional<std::string> StudiedScene::answer(const std::string& study,
                                                const std::vector<std::string>& words) {
  constexpr int kUsage = 2, kDiverged = 4, kKilled = 128;
  study_ = study;
  std::vector<std::string> all{study, file_};
  all.insert(all.end(), words.begin(), words.end());
  const Outcome outcome = limited_run(all);
  if (outcome.code == 0) return outcome.out;
  const bool case_killed = outcome.out.find("ended by signal") != std::string::npos;
  if (outcome.code == kKilled + SIGKILL || outcome.code == kKilled + SIGXCPU || case_killed)
    ++tally().set_aside;
  else if (outcome.code == kUsage || outcome.code == kDiverged)
    ++tally().refused;
  else
    claim(false, "exit code " + std::to_string(outcome.code) + ": " + outcome.err);
  return {};
}

std::optional<Json> StudiedScene::ask(const std::string& study,
                                      const std::vector<std::string>& words) {
  std::vector<std::string> all = words;
  all.emplace_back("--json");
  const auto text = answer(study, all);
  if (!text) return {};
  return read_json(*text);
}

void StudiedScene::claim(bool held, const std::string& words) {
  ++(held ? tally().held : tally().wrong);
  if (!held)
    out_ << "seed " << seed_ << ", " << kind_ << ": " << study_ << ": " << words << '\n'
         << std::flush;
}

const Motion* StudiedScene::motion(double time) {
  auto [found, is_new] = motions_.try_emplace(time);
  if (is_new)
    found->second =
        motion_of(spec_, {.time = time, .look = sim::study::coordinates}, Patience(), registry_);
  return found->second ? &*found->second : nullptr;
}

sim::RunOptions StudiedScene::options(const std::string& method, double dt,
                                      double tolerance) const {
  sim::RunOptions options{.integrator = {method}, .dt = tolerance > 0 ? spec_.dt : dt};
  if (tolerance > 0) options.integrator.given["tol"] = tolerance;
  return options;
}

SeenCourse StudiedScene::run(const sim::RunOptions& options, double time) const {
  return course_of(spec_, options, {.time = time, .look = sim::study::coordinates}, Patience(),
                   registry_);
}

std::vector<std::string> StudiedScene::some_methods(int count) {
  std::vector<std::string> left = methods_, some;
  while (!left.empty() && static_cast<int>(some.size()) < count) {
    const auto at = left.begin() + random_.integer(0, static_cast<int>(left.size()) - 1);
    some.push_back(*at);
    left.erase(at);
  }
  return some;
}

int hunt_studies(std::span<char* const> words) {
  const long cases = !words.empty() ? std::atol(words[0]) : 50;
  const auto first = static_cast<std::uint64_t>(words.size() > 1 ? std::atoll(words[1]) : 1);
  sim::Registry registry = make_registry();
  std::map<std::string, ClaimTally> all;
  const std::clock_t begin = std::clock();
  for (std::uint64_t seed = first; seed < first + static_cast<std::uint64_t>(cases); ++seed) {
    StudiedScene scene(seed, registry, all, std::cout);
    for (const auto check :
         {&StudiedScene::check_tradeoff, &StudiedScene::check_order, &StudiedScene::check_compare,
          &StudiedScene::check_stability, &StudiedScene::check_minimal, &StudiedScene::check_rest,
          &StudiedScene::check_sweep}) {
      try {
        (scene.*check)();
      } catch (const std::exception& failure) {  // an answer that is no JSON, or lacks something
        scene.claim(false, failure.what());
      }
    }
  }
  std::cout << "\nstudy       claims held   false   not known   scenes refused   set aside\n";
  int wrong = 0;
  for (const char* study : kStudies) {
    const ClaimTally& each = all[study];
    wrong += each.wrong;
    std::cout << std::left << std::setw(12) << study << std::right << std::setw(11) << each.held
              << std::setw(8) << each.wrong << std::setw(12) << each.unknown << std::setw(17)
              << each.refused << std::setw(12) << each.set_aside << '\n';
  }
  std::cout << cases << " scenes, " << wrong << " false claims, "
            << (std::clock() - begin) / CLOCKS_PER_SEC << " s\n";
  return wrong == 0 ? 0 : 1;
}

}  // namespace sim_test
