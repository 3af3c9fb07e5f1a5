// States in single precision beside those in double precision.
#include "core/particles/explicit/precision_state.h"

#include <catch2/catch.hpp>
#include <cmath>

using namespace sim;

namespace {

double number(int block, int i) { return (block + 1) / 3.0 + 7.0 * i; }

Array state_of(const Layout& layout) {
  Array x(layout.size());
  for (int block = 0; block < 6; ++block)
    for (int i = 0; i < layout.n(); ++i) layout.block(x.data(), block)[i] = number(block, i);
  return x;
}

}  // namespace

TEST_CASE("a state in single precision is rounded once, and published where it is done",
          "[particles]") {
  for (const int n : {1, 7, 8, 9, 40}) {
    const Layout given(n);
    PrecisionState<float> state(given);
    const Array x = state_of(given);
    const float* const from = state.from(x.data());
    for (int block = 0; block < 6; ++block)
      for (int i = 0; i < n; ++i)
        CHECK(state.layout().block(from, block)[i] == static_cast<float>(number(block, i)));
    // The next one, of which some particles at a time are published.
    for (const auto& [begin, end] : {std::pair{0, n}, {0, n / 2}, {n / 2, n}, {n / 3, n / 2}}) {
      Array next(given.size());
      for (double& each : next.span()) each = -1;
      float* const to = state.to(next.data());
      for (int block = 0; block < 6; ++block)
        for (int i = 0; i < n; ++i)
          state.layout().block(to, block)[i] = 0.1F * static_cast<float>(block + 10 * i);
      state.publish(next.data(), begin, end);
      INFO(n << " particles, " << begin << " to " << end);
      for (int block = 0; block < 6; ++block)
        for (int i = -Layout::kPad; i < n + Layout::kPad; ++i) {
          const bool done = i >= begin && i < end;
          CHECK(given.block(next.data(), block)[i] ==
                (done ? static_cast<double>(0.1F * static_cast<float>(block + 10 * i)) : -1.0));
        }
      // A state that it made itself is not rounded; those of others are, and after forget() all.
      if (begin == 0 && end == n) {
        CHECK(state.from(next.data()) == to);
        next.data()[given.offset(0)] = 5;
        CHECK(state.layout().block(state.from(next.data()), 0)[0] != 5);
        state.forget();
        CHECK(state.layout().block(state.from(next.data()), 0)[0] == 5);
      }
    }
  }
}
