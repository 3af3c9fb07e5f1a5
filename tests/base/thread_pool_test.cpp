#include "core/base/thread_pool.h"

#include <catch2/catch.hpp>

#include <vector>

#include "core/base/noise.h"

using namespace sim;

TEST_CASE("every member of a team runs once, whatever the number", "[base]") {
  for (const int size : {1, 2, 3, 8}) {
    ThreadPool pool(size);
    std::vector<int> runs(static_cast<std::size_t>(size));
    for (int i = 0; i < 2000; ++i)
      pool.run([&](int rank) { ++runs[static_cast<std::size_t>(rank)]; });
    for (const int count : runs) CHECK(count == 2000);
  }
}

TEST_CASE("members that fell asleep are woken", "[base]") {
  ThreadPool pool(3);
  std::vector<int> runs(3);
  for (int i = 0; i < 5; ++i) {
    pool.run([&](int rank) { ++runs[static_cast<std::size_t>(rank)]; });
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  CHECK(runs == std::vector<int>{5, 5, 5});
}

TEST_CASE("only those members run that are used, whatever was used before", "[base]") {
  ThreadPool pool(4);
  std::vector<int> runs(4), expected(4);
  Noise noise;
  const auto below = [&](int n) { return static_cast<int>((noise.next() + 0.5) * n); };
  for (int i = 0; i < 3000; ++i) {
    const int size = 1 + below(4);
    pool.use(size);
    CHECK(pool.size() == size);
    // Some fall asleep between two runs.
    if (i % 500 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(2));
    for (int times = below(3); times > 0; --times) {
      pool.run([&](int rank) { ++runs[static_cast<std::size_t>(rank)]; });
      for (std::size_t rank = 0; rank < static_cast<std::size_t>(size); ++rank) ++expected[rank];
    }
  }
  CHECK(pool.most() == 4);
  CHECK(runs == expected);
}

TEST_CASE("parts cover all items once, in whole grains", "[base]") {
  for (const int n : {0, 1, 7, 8, 9, 63, 64, 1000})
    for (const int ranks : {1, 2, 3, 7}) {
      int next = 0;
      for (int rank = 0; rank < ranks; ++rank) {
        const Part part = part_of(n, 8, rank, ranks);
        CHECK(part.begin == next);
        CHECK((part.begin % 8 == 0 || part.begin == n));
        next = part.end;
      }
      CHECK(next == n);
    }
}
