#include "core/base/thread_count_tuner.h"

#include <catch2/catch.hpp>

#include <functional>
#include <map>

using namespace sim;

namespace {

// Steps that take cost(members) seconds of a clock of their own.
class Steps {
 public:
  Steps(int most, std::function<double(int)> each)
      : cost(std::move(each)), pool(most), choice_(pool, [this] { return time; }) {}

  void take(int count) {
    for (int i = 0; i < count; ++i) {
      choice_.begin();
      time += cost(pool.size());
      ++steps_on[pool.size()];
      choice_.end(1);
      time += 1;  // what a program does between steps is not theirs
    }
  }

  std::function<double(int)> cost;
  ThreadPool pool;
  double time = 0;
  std::map<int, int> steps_on;

 private:
  ThreadCountTuner choice_;
};

// On so many threads a share of the work is done at once, and each wait takes its time.
auto shared(double work, double wait) {
  return [=](int threads) { return work / threads + wait * (threads - 1); };
}

}  // namespace

TEST_CASE("steps take as many threads as pay", "[base]") {
  const auto chosen = [](int most, const std::function<double(int)>& cost) {
    Steps steps(most, cost);
    steps.take(1000);
    steps.steps_on.clear();
    steps.take(100'000);
    int best = 1;
    for (const auto& [size, count] : steps.steps_on)
      if (count > steps.steps_on[best]) best = size;
    CHECK(steps.steps_on[best] > 97'000);  // few are trials
    return best;
  };
  CHECK(chosen(2, shared(1e-5, 1e-4)) == 1);
  CHECK(chosen(2, shared(1e-3, 1e-5)) == 2);
  const auto hardly_faster = [](int threads) { return threads == 1 ? 1e-3 : 0.85e-3; };
  CHECK(chosen(2, hardly_faster) == 1);
  CHECK(chosen(8, shared(1e-3, 1e-5)) == 8);
  CHECK(chosen(8, shared(1e-3, 5e-5)) == 4);
  CHECK(chosen(6, shared(1e-2, 1e-6)) == 6);
}

TEST_CASE("what pays is asked again", "[base]") {
  Steps steps(4, shared(1e-3, 1e-6));
  steps.take(20'000);
  CHECK(steps.pool.size() == 4);
  steps.cost = shared(1e-3, 1e-2);  // another program has come
  steps.take(5'000);
  CHECK(steps.pool.size() <= 2);
  steps.take(200'000);
  steps.steps_on.clear();
  steps.take(1'000);
  CHECK(steps.steps_on[1] > 950);
  steps.cost = shared(1e-3, 1e-6);
  steps.take(20'000);
  CHECK(steps.pool.size() == 4);
}

// Stretches between trials are of time, not of so many steps: a pile lands, for one.
TEST_CASE("what pays is asked again soon where steps get much longer", "[base]") {
  Steps steps(2, shared(1e-4, 1e-3));
  steps.take(1000);
  CHECK(steps.pool.size() == 1);
  steps.cost = shared(1.0, 0.01);
  steps.take(20);
  CHECK(steps.pool.size() == 2);
}

TEST_CASE("long steps are tried once each", "[base]") {
  Steps steps(2, shared(1.0, 0.01));
  steps.take(20);
  CHECK(steps.steps_on[1] == 1);
  CHECK(steps.steps_on[2] == 19);
}
