// Acceleration of an iteration towards its fixed point.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

namespace sim {

// Anderson acceleration (Anderson (1965), J. ACM 12, 547-560) of an iteration x -> g(x): the last
// changes of g(x) - x are combined to minimise the residual in the least-squares sense; for a
// linear iteration it is GMRES (Walker & Ni (2011), SIAM J. Numer. Anal. 49, 1715-1735). It
// restarts where g(x) - x grows, as at a kink of g, and when its memory is full, which may then
// hold more. If it diverges it returns to the best image so far and pauses, each time for twice as
// many iterations.
class Anderson {
 public:
  static constexpr std::size_t kMost = 32;  // pairs of vectors
  // The count of numbers that it stores for n unknowns.
  static constexpr std::size_t memory(std::size_t n) { return (2 * kMost + 3) * n; }

  Anderson(std::span<double> memory, std::size_t n) : memory_(memory), n_(n) {}

  // x and g(x), which becomes the next x. Both are overwritten.
  void mix(std::span<double> x, std::span<double> g);

  // The state from before the first mix().
  void begin_at(std::span<const double> x) { std::ranges::copy(x, part(2).begin()); }

  // The image of the x with the smallest residual so far.
  std::span<const double> best() const { return part(2); }

 private:
  std::span<double> part(std::size_t k) const { return memory_.subspan(k * n_, n_); }
  std::span<double> change_of_residual(std::size_t k) const { return part(2 * k + 3); }
  std::span<double> change_of_image(std::size_t k) const { return part(2 * k + 4); }
  void remember(std::span<const double> residual, std::span<const double> image);

  std::span<double> memory_;
  std::size_t n_, held_ = 0, window_ = 8;
  double last_ = -1, least_ = -1;  // the sizes of residuals; < 0: none
  int pause_ = 1, alone_ = 0;      // steps without mixing, the next time and still
};

}  // namespace sim
