// Work from a power that is looked at now and then.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace sim::study {

// The integral of a power given at looks t_0 < t_1 < ..., W to the last of them. The piece between
// two looks is that of the cubic through the last four; its uncertainty is the sum of what the
// parabolas through three give otherwise.
class WorkIntegral {
 public:
  void look(double t, double power);  // s, W
  void part();  // behind the last look the power is another function: it may jump there
  double value() const { return before_ + value_; }
  double with(double t, double power) const;  // value() if that were the next look
  double uncertainty() const;                 // J; infinite before the seventh look
  // |what the parabola through three looks gives otherwise| of the last piece, in J; infinite where
  // there was no cubic yet.
  double doubt() const { return looks_ > kNodes ? doubt_ : HUGE_VAL; }
  bool settled() const { return before_ != 0 || looks_ >= kNodes; }  // its first pieces are final

  // All of it as numbers; recall() goes on from there, bit for bit. False for other numbers.
  std::vector<double> memory() const;
  bool recall(std::span<const double> memory);

 private:
  static constexpr int kNodes = 4;

  std::int64_t looks_ = 0;
  double t_[kNodes] = {}, power_[kNodes] = {};  // the last ones, ascending
  double value_ = 0, by_parabolas_ = 0;         // J, of this part
  double before_ = 0, before_by_parabolas_ = 0;
  double doubt_ = 0;  // J
};

}  // namespace sim::study
