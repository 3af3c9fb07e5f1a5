// How often a loop looks up.
#include <catch2/catch.hpp>
#include <chrono>
#include <thread>

#include "core/base/pacer.h"

TEST_CASE("a loop of short rounds looks up now and then, one of long rounds in all but one") {
  sim::Pacer pacer;
  CHECK(pacer.due());  // the first round: whether to begin at all
  int looks = 0;
  constexpr int kRounds = 100000;
  for (int round = 0; round < kRounds; ++round) looks += pacer.due();
  CHECK(looks > kRounds / 2000);  // after 1024 rounds at most
  CHECK(looks < kRounds / 10);

  sim::Pacer slow;
  looks = 0;
  for (int round = 0; round < 6; ++round) {
    looks += slow.due();
    std::this_thread::sleep_for(std::chrono::milliseconds(3));
  }
  CHECK(looks >= 5);  // the second round is not yet known to be long
}
