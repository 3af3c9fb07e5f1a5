// The states of a step in the precision of a stepper, single or double.
#pragma once

#include "core/base/array.h"
#include "core/base/layout.h"
#include "core/particles/explicit/sweep.h"
#include "core/simd/convert.h"

namespace sim {

// A stepper in double precision works on the states that it is given.
template <class Real>
class PrecisionState {
 public:
  explicit PrecisionState(const Layout& given) : layout_(given) {}

  const Layout& layout() const { return layout_; }
  const Real* from(const double* x) const { return x; }
  Real* to(double* x_next) const { return x_next; }
  void publish(double* /*x_next*/, int /*begin*/, int /*end*/) const {}
  void forget() const {}
  int at_once() const { return 1; }

 private:
  Layout layout_;
};

// A state in single precision is stored apart, and the given ones hold the same numbers as doubles.
// Only a state that it did not make itself is rounded.
template <>
class PrecisionState<float> {
 public:
  explicit PrecisionState(const Layout& given)
      : given_(given), layout_(given.n(), 6, kBlock<float>) {
    for (ArrayOf<float>& state : states_) state = ArrayOf<float>(layout_.size());
  }

  const Layout& layout() const { return layout_; }

  const float* from(const double* x) {
    float* const state = states_[now_].data();
    if (x != last_)
      for (int block = 0; block < 6; ++block)
        convert_.to_float(given_.block(x, block), layout_.block(state, block), layout_.n());
    return state;
  }

  // The memory for the next state, which from() will find at x_next.
  float* to(double* x_next) {
    last_ = x_next;
    now_ = 1 - now_;
    return states_[now_].data();
  }

  // Publishes particles [begin, end) of the next state in x_next.
  void publish(double* x_next, int begin, int end) const {
    for (int block = 0; block < 6; ++block)
      convert_.to_double(layout_.block(states_[now_].data(), block) + begin,
                         given_.block(x_next, block) + begin, end - begin);
  }

  void forget() { last_ = nullptr; }

  // Only the last state of several steps has to be published.
  int at_once() const { return 8; }

 private:
  Layout given_, layout_;
  Convert convert_ = convert();
  ArrayOf<float> states_[2];
  int now_ = 0;
  const double* last_ = nullptr;
};

}  // namespace sim
