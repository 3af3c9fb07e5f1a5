// Numbers that are not finite.
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "core/base/finite.h"

TEST_CASE("an error that is not a number is the largest, wherever it stands") {
  for (std::size_t at = 0; at < 4; ++at) {
    std::array<double, 4> errors{0.5, 2, 0, 1};
    const auto largest = [&] {
      double most = 0;
      for (const double error : errors) most = sim::larger_error(error, most);
      return most;
    };
    CHECK(largest() == 2);
    errors[at] = HUGE_VAL;
    CHECK(largest() == HUGE_VAL);
    errors[at] = std::nan("");
    CHECK(std::isnan(largest()));
    errors[(at + 1) % 4] = HUGE_VAL;
    CHECK(std::isnan(largest()));
  }
}

TEST_CASE("a state with one number that is not finite is not finite") {
  for (std::size_t size = 0; size < 40; ++size) {
    std::vector<double> state(size, -1e308);
    CHECK(sim::all_finite(state));
    for (double& number : state)
      for (const double wrong : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
        number = wrong;
        CHECK_FALSE(sim::all_finite(state));
        number = 1e308;
      }
  }
}
