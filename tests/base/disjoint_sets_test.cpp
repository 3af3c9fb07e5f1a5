#include "core/base/disjoint_sets.h"

#include <catch2/catch.hpp>
#include <random>
#include <vector>

TEST_CASE("disjoint sets are those of painting one set in the colour of another") {
  std::mt19937 random(7);
  for (const int n : {1, 2, 10, 1000}) {
    sim::DisjointSets sets(static_cast<std::size_t>(n));
    std::vector<int> colour;
    for (int i = 0; i < n; ++i) colour.push_back(i);
    for (int k = 0; k < 2 * n / 3; ++k) {
      const int a = static_cast<int>(random() % static_cast<unsigned>(n));
      const int b = static_cast<int>(random() % static_cast<unsigned>(n));
      sets.join(a, b);
      const auto [low, high] = std::minmax({colour[sim::slot(a)], colour[sim::slot(b)]});
      std::ranges::replace(colour, high, low);
    }
    for (int i = 0; i < n; ++i) REQUIRE(sets.root(i) == colour[sim::slot(i)]);
  }
}

TEST_CASE("disjoint sets are separated again, and joined all at once") {
  sim::DisjointSets sets(4);
  sets.join(std::vector{3, 1, 2});
  CHECK(sets.root(2) == 1);
  CHECK(sets.root(3) == 1);
  CHECK(sets.root(0) == 0);
  sets.join(std::vector<int>{});
  sets.separate(6);
  CHECK(sets.size() == 6);
  for (int i = 0; i < 6; ++i) CHECK(sets.root(i) == i);
}
