#include "tests/bench/timing.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace sim_bench {
namespace {

// Steps that take at least `seconds`.
long steps_to_fill(const Contestant& contestant, double seconds) {
  long count = 1;
  for (;;) {
    const double taken = contestant.run(count);
    if (taken >= seconds) return count;
    const double factor = taken > 0 ? 1.2 * seconds / taken : 16;
    count =
        std::max(count + 1, static_cast<long>(static_cast<double>(count) * std::min(factor, 16.0)));
  }
}

}  // namespace

double seconds_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

Times times_of(std::vector<double> samples) {
  if (samples.empty()) return {};
  std::ranges::sort(samples);
  return {samples[samples.size() / 2], samples.front(), samples.back()};
}

std::vector<Times> measure(const std::vector<Contestant>& contestants,
                           const TimingOptions& options) {
  std::vector<long> counts;
  for (const Contestant& contestant : contestants)
    counts.push_back(steps_to_fill(contestant, options.seconds));

  std::vector<std::vector<double>> samples(contestants.size());
  for (int repeat = 0; repeat < options.repeats; ++repeat)
    for (std::size_t i = 0; i < contestants.size(); ++i)
      samples[i].push_back(contestants[i].run(counts[i]) / static_cast<double>(counts[i]));

  std::vector<Times> times;
  for (std::vector<double>& sample : samples) times.push_back(times_of(std::move(sample)));
  return times;
}

}  // namespace sim_bench
