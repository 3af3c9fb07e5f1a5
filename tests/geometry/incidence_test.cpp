// The elements at each particle.
#include "core/geometry/incidence.h"

#include <catch2/catch.hpp>

TEST_CASE("elements are found at their particles, and nowhere else", "[geometry]") {
  const int ids[] = {7, 5, 9, 5, 7, 6};
  const sim::Incidence incidence(20, ids);
  const auto at = [&](int i) {
    return std::vector<int>(incidence.at(i).begin(), incidence.at(i).end());
  };
  CHECK(at(5) == std::vector{1, 3});
  CHECK(at(6) == std::vector{5});
  CHECK(at(7) == std::vector{0, 4});
  CHECK(at(9) == std::vector{2});
  for (const int i : {0, 4, 8, 10, 19}) CHECK(at(i).empty());
  using Part = std::array<int, 2>;
  CHECK(incidence.within(0, 20) == Part{5, 10});
  CHECK(incidence.within(6, 8) == Part{6, 8});
  for (const auto& [begin, end] : {Part{0, 5}, Part{10, 20}, Part{3, 3}}) {
    const auto [from, to] = incidence.within(begin, end);
    CHECK(from == to);
  }
  CHECK(sim::Incidence(3, {}).at(1).empty());
  CHECK(sim::Incidence().within(0, 3)[0] == sim::Incidence().within(0, 3)[1]);
}
