// The memory layout of a particle state: one padded, aligned array a coordinate.
#pragma once

#include <array>
#include <cstddef>

namespace sim {

// X = x | y | z | vx | vy | vz, each of `stride` numbers; the first `pad` of them and at least
// `pad` after the n values are padding, which is finite and never changes.
class Layout {
 public:
  static constexpr int kPad = 8;

  Layout() = default;
  explicit Layout(int n, int blocks = 6, int pad = kPad) : n_(n), blocks_(blocks), pad_(pad) {
    const auto grain = static_cast<std::size_t>(pad);
    stride_ = (static_cast<std::size_t>(n) + grain - 1) / grain * grain + 2 * grain;
    // Large arrays must not start a multiple of 4 KiB apart, or their lines compete for few cache
    // sets and loads wait for stores that only look like their own.
    if (n >= 1024)
      while (stride_ % 512 != 88) stride_ += 8;
  }

  int n() const noexcept { return n_; }
  std::size_t size() const noexcept { return stride_ * static_cast<std::size_t>(blocks_); }

  // The offset of coordinate `block` (0 .. 5) in a state, after its padding.
  std::size_t offset(int block) const noexcept {
    return static_cast<std::size_t>(block) * stride_ + static_cast<std::size_t>(pad_);
  }

  // The values of coordinate `block` (0 .. 5) in a state; null for a null state.
  template <class T>
  T* block(T* state, int block) const noexcept {
    return state ? state + offset(block) : nullptr;
  }

  // The arrays of three coordinates, from block `first` on.
  template <class T>
  std::array<T*, 3> axes(T* state, int first = 0) const noexcept {
    return {block(state, first), block(state, first + 1), block(state, first + 2)};
  }

 private:
  int n_ = 0, blocks_ = 0, pad_ = kPad;
  std::size_t stride_ = 0;
};

}  // namespace sim
