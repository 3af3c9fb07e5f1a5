// Words: goals ..., studies [N [SEED]], show KIND SEED, or [KIND | all] [N [SEED]]; without a kind
// the chains, cloths and fields that extrapolation judges.
#include <cctype>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <iomanip>
#include <iostream>

#include "tests/hunt/goals.h"
#include "tests/hunt/hunt.h"
#include "tests/hunt/kinds.h"
#include "tests/hunt/studies.h"
#include "tests/support/scenes.h"

namespace {

using namespace sim_test;

// `hunt` judges the scene of a seed.
template <class Hunt>
bool hunt_all(long cases, std::uint64_t first, double right_share, const Hunt& hunt) {
  Tally tally{.right_share = right_share};
  const std::clock_t begin = std::clock();
  for (std::uint64_t seed = first; seed < first + static_cast<std::uint64_t>(cases); ++seed) {
    const Case found = hunt(seed);
    tally.add(found);
    if (!found.failed.empty() || found.set_aside) {
      std::cout << "seed " << seed << ": " << found.words << ": "
                << (found.set_aside ? "set aside" : found.failed) << '\n'
                << std::flush;
      continue;
    }
    using sim::study::Trust;
    const bool wrong = found.truth == Truth::kWrong || found.truth == Truth::kWrongAndChaotic;
    const bool short_told = found.verdict == Trust::kTrusted && found.told < 2.0 / 3;
    const bool false_alarm = found.verdict >= Trust::kSuspect && found.truth == Truth::kRight;
    if ((found.verdict == Trust::kTrusted && wrong) || false_alarm || short_told || found.late)
      std::cout << found << std::flush;
  }
  std::cout << '\n'
            << tally << ", " << (std::clock() - begin) / CLOCKS_PER_SEC << " s\n"
            << std::flush;
  return tally.good();
}

}  // namespace

int main(int argc, char** argv) {
  std::span<char*> words(argv + 1, static_cast<std::size_t>(argc - 1));
  if (!words.empty() && std::strcmp(words[0], "goals") == 0) return hunt_goals(words.subspan(1));
  if (!words.empty() && std::strcmp(words[0], "studies") == 0)
    return hunt_studies(words.subspan(1));
  if (words.size() == 3 && std::strcmp(words[0], "show") == 0) {
    for (const HuntKind& kind : hunt_kinds())
      if (std::strcmp(kind.name, words[1]) == 0)
        std::cout << kind.scene(static_cast<std::uint64_t>(std::atoll(words[2])));
    return 0;
  }
  std::string asked;
  if (!words.empty() && !std::isdigit(static_cast<unsigned char>(*words[0]))) {
    asked = words[0];
    words = words.subspan(1);
  }
  const long cases = !words.empty() ? std::atol(words[0]) : 1000;
  const auto first = static_cast<std::uint64_t>(words.size() > 1 ? std::atoll(words[1]) : 1);
  sim::Registry registry = make_registry();
  if (asked.empty())
    return hunt_all(cases, first, kRight,
                    [&](std::uint64_t seed) { return hunt_one(seed, registry); })
               ? 0
               : 1;
  bool good = true, any = false;
  for (const HuntKind& kind : hunt_kinds()) {
    if (asked != "all" && asked != kind.name) continue;
    any = true;
    std::cout << "--- " << kind.name << '\n';
    good &= hunt_all(cases, first, kRightOfKinds,
                     [&](std::uint64_t seed) { return hunt_one(kind, seed, registry); });
  }
  if (any) return good ? 0 : 1;
  std::cerr << "no kind '" << asked << "'; known: all, goals, studies";
  for (const HuntKind& kind : hunt_kinds()) std::cerr << ", " << kind.name;
  std::cerr << '\n';
  return 2;
}
