// Times of several contestants, taken in turns so that a change of the machine meets all of them.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace sim_bench {

double seconds_now();

// One contestant: run(count) takes `count` steps and returns the seconds they took.
struct Contestant {
  std::function<double(long count)> run;
};

struct Times {
  double median = 0, least = 0, most = 0;  // seconds a step
};

// The spread of samples; 0 of none.
Times times_of(std::vector<double> samples);

struct TimingOptions {
  int repeats = 7;
  double seconds = 0.04;  // of one repeat, at least
};

// Finds for each the number of steps that fills a repeat (which warms it up), then measures A B C
// A B C ... The result has an entry for each contestant.
std::vector<Times> measure(const std::vector<Contestant>& contestants,
                           const TimingOptions& options);

}  // namespace sim_bench
