// sim_hunt [CASES [SEED]]: looks for runs that are called trusted and are wrong.
// sim_hunt goals WORDS: looks for errors that are said to be kept and are not, see goals.h.
#include <cstdlib>
#include <iostream>
#include <string_view>

#include "tests/hunt/goals.h"
#include "tests/hunt/hunt.h"
#include "tests/support/scenes.h"

int main(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "goals")
    return sim_test::hunt_goals({argv + 2, static_cast<std::size_t>(argc - 2)});
  const long cases = argc > 1 ? std::atol(argv[1]) : 1000;
  const auto first = static_cast<std::uint64_t>(argc > 2 ? std::atoll(argv[2]) : 1);
  sim::Registry registry = sim_test::make_registry();
  sim_test::Tally tally;
  for (std::uint64_t seed = first; seed < first + static_cast<std::uint64_t>(cases); ++seed) {
    const sim_test::Case found = sim_test::hunt_one(seed, registry);
    tally.add(found);
    using sim::study::Trust;
    using sim_test::Truth;
    const bool false_trust =
        found.verdict == Trust::kTrusted &&
        (found.truth == Truth::kWrong || found.truth == Truth::kWrongAndChaotic);
    const bool false_alarm = found.verdict >= Trust::kSuspect && found.truth == Truth::kRight;
    if (false_trust || false_alarm) std::cout << found << std::flush;
  }
  std::cout << '\n' << tally;
  // At most 3 of 1000 false trusts, at most 3 % of the right runs doubted.
  const bool good = 1000 * tally.trusted_but_wrong() <= 3 * tally.judged() &&
                    100 * tally.right_but_doubted() <= 3 * tally.right();
  return good ? 0 : 1;
}
