#include "core/study/work_integral.h"

#include <algorithm>
#include <cmath>

namespace sim::study {
namespace {

// The polynomial through the nodes at `at` (Neville 1934).
double interpolated(std::span<const double> t, std::span<const double> values, double at) {
  double p[4];
  std::ranges::copy(values, p);
  for (std::size_t width = 1; width < t.size(); ++width)
    for (std::size_t i = 0; i + width < t.size(); ++i)
      p[i] = ((at - t[i + width]) * p[i] - (at - t[i]) * p[i + 1]) / (t[i] - t[i + width]);
  return p[0];
}

// Its integral from `from` to `to`; Gauss's rule of two points is exact for cubics.
double integral(std::span<const double> t, std::span<const double> values, double from, double to) {
  const double middle = 0.5 * (from + to), half = 0.5 * (to - from), node = half / std::sqrt(3.0);
  return half * (interpolated(t, values, middle - node) + interpolated(t, values, middle + node));
}

}  // namespace

void WorkIntegral::look(double t, double power) {
  if (looks_ >= kNodes) {
    std::shift_left(std::begin(t_), std::end(t_), 1);
    std::shift_left(std::begin(power_), std::end(power_), 1);
  }
  const auto count = static_cast<std::size_t>(std::min<std::int64_t>(++looks_, kNodes));
  t_[count - 1] = t;
  power_[count - 1] = power;
  if (count < 2) return;
  const std::span<const double> times(t_, count), powers(power_, count);
  // The first pieces are taken anew until there are enough looks for a cubic.
  const bool anew = looks_ <= kNodes;
  const double piece = integral(times, powers, anew ? t_[0] : t_[count - 2], t);
  value_ = anew ? piece : value_ + piece;
  if (looks_ <= 3) {
    by_parabolas_ = piece;
    return;
  }
  const double by_parabola = integral(times.last(3), powers.last(3), t_[count - 2], t);
  by_parabolas_ += by_parabola;
  doubt_ = std::abs(piece - by_parabola);
}

void WorkIntegral::part() {
  before_ += value_;
  before_by_parabolas_ += by_parabolas_;
  value_ = by_parabolas_ = 0;
  looks_ = 0;
}

double WorkIntegral::with(double t, double power) const {
  WorkIntegral next = *this;
  next.look(t, power);
  return next.value();
}

double WorkIntegral::uncertainty() const {
  constexpr int kEnough = 7;
  if (looks_ < kEnough && before_ == 0) return HUGE_VAL;
  return 2 * std::abs(value() - (before_by_parabolas_ + by_parabolas_));
}

std::vector<double> WorkIntegral::memory() const {
  std::vector<double> numbers{static_cast<double>(looks_), value_, by_parabolas_};
  numbers.insert(numbers.end(), std::begin(t_), std::end(t_));
  numbers.insert(numbers.end(), std::begin(power_), std::end(power_));
  if (before_ != 0) numbers.insert(numbers.end(), {before_, before_by_parabolas_});
  return numbers;
}

bool WorkIntegral::recall(std::span<const double> memory) {
  constexpr std::size_t kNumbers = 3 + 2 * kNodes;
  const bool parts = memory.size() == kNumbers + 2;
  if ((memory.size() != kNumbers && !parts) || !(memory[0] >= 0 && memory[0] < 1e15)) return false;
  looks_ = static_cast<std::int64_t>(memory[0]);
  value_ = memory[1];
  by_parabolas_ = memory[2];
  std::copy_n(memory.begin() + 3, kNodes, t_);
  std::copy_n(memory.begin() + 3 + kNodes, kNodes, power_);
  before_ = parts ? memory[kNumbers] : 0;
  before_by_parabolas_ = parts ? memory[kNumbers + 1] : 0;
  return true;
}

}  // namespace sim::study
