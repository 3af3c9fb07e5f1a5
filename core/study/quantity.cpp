#include "core/study/quantity.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/base/error.h"
#include "core/base/text.h"

namespace sim::study {
namespace {

using Values = std::span<const double>;

constexpr std::pair<const char*, Figure> kFigures[] = {{"mean", Figure::kMean},
                                                       {"max", Figure::kMost},
                                                       {"min", Figure::kLeast},
                                                       {"period", Figure::kPeriod}};

// The interpolating polynomial through the four values, or all if there are fewer, around the
// interval from i to i + 1, in Newton's form.
class Piece {
 public:
  Piece(Values t, Values v, std::size_t i) : n_(std::min<std::size_t>(4, t.size())) {
    const std::size_t first = std::min(i > 0 ? i - 1 : 0, t.size() - n_);
    for (std::size_t k = 0; k < n_; ++k) {
      t_[k] = t[first + k];
      c_[k] = v[first + k];
    }
    for (std::size_t order = 1; order < n_; ++order)
      for (std::size_t k = n_ - 1; k >= order; --k)
        c_[k] = (c_[k] - c_[k - 1]) / (t_[k] - t_[k - order]);
  }
  double at(double x) const {
    double sum = 0;
    for (std::size_t k = n_; k-- > 0;) sum = sum * (x - t_[k]) + c_[k];
    return sum;
  }
  // Two-point Gauss quadrature is exact for cubics.
  double integral(double from, double to) const {
    const double mid = (from + to) / 2, half = (to - from) / 2, off = half / std::sqrt(3.0);
    return half * (at(mid - off) + at(mid + off));
  }

 private:
  std::size_t n_;
  std::array<double, 4> t_{}, c_{};
};

double mean(Values t, Values v, double from) {
  if (t.size() < 2) return v.back();
  double sum = 0;
  for (std::size_t i = 0; i + 1 < t.size(); ++i)
    if (t[i + 1] > from) sum += Piece(t, v, i).integral(std::max(from, t[i]), t[i + 1]);
  return sum / (t.back() - from);
}

// The coefficient of the square in the parabola through value i and both its neighbours.
double curve_at(Values t, Values v, std::size_t i) {
  const double rise = (v[i] - v[i - 1]) / (t[i] - t[i - 1]);
  const double fall = (v[i + 1] - v[i]) / (t[i + 1] - t[i]);
  return (fall - rise) / (t[i + 1] - t[i - 1]);
}

// The vertex of the parabola through the largest value and both its neighbours. A smooth peak
// curves at these neighbours nearly as much as between them, unlike a jump or a kink, where the
// parabola would go beyond all values of the signal.
double largest(Values t, Values v) {
  constexpr double kSteeper = 4;  // than at a neighbour
  const auto i = static_cast<std::size_t>(std::ranges::max_element(v) - v.begin());
  if (i == 0 || i + 1 == v.size() || v.size() < 4) return v[i];
  const double curve = -curve_at(t, v, i);
  if (!(curve > 0)) return v[i];
  double smooth = curve;
  if (i > 1) smooth = std::min(smooth, -kSteeper * curve_at(t, v, i - 1));
  if (i + 2 < v.size()) smooth = std::min(smooth, -kSteeper * curve_at(t, v, i + 1));
  const double left = t[i] - t[i - 1];
  const double ahead = ((v[i] - v[i - 1]) / left - curve * left) / (2 * curve);
  return v[i] + std::max(0.0, smooth) * ahead * ahead;
}

// The time at which it crosses the level between i and i + 1, by bisection.
double rise_between(Values t, Values v, std::size_t i, double level) {
  const Piece piece(t, v, i);
  double low = t[i], high = t[i + 1];
  for (int k = 0; k < 60; ++k) {
    const double mid = (low + high) / 2;
    (piece.at(mid) < level ? low : high) = mid;
  }
  return (low + high) / 2;
}

double period(Values t, Values v, double from) {
  constexpr double kFall = 0.05;  // of the range, against ripples at the level
  const double level = mean(t, v, from);
  const auto [least, most] = std::ranges::minmax_element(v);
  const double below = level - kFall * (*most - *least);
  double first = 0, last = 0;
  int rises = 0;
  bool fallen = false;
  for (std::size_t i = 0; i + 1 < v.size(); ++i) {
    fallen = fallen || v[i] < below;
    if (!fallen || v[i + 1] < level) continue;
    last = rise_between(t, v, i, level);
    if (rises++ == 0) first = last;
    fallen = false;
  }
  return rises > 1 ? (last - first) / (rises - 1) : std::nan("");
}

[[noreturn]] void unknown(const SystemSpec& spec, const std::string& text, const std::string& why,
                          const std::string& remedy) {
  throw Error(ErrorKind::kUsage,
              {"unknown quantity", "--of '" + text + "'", why + " ('" + spec.name + "')", remedy});
}

}  // namespace

Quantity::Quantity(const SystemSpec& spec, const std::string& text) : text_(text) {
  std::string rest = text;
  const auto begins = [&](const std::string& word) {
    if (!rest.starts_with(word + " ")) return false;
    rest.erase(0, word.size() + 1);
    return true;
  };
  late_ = begins("late");
  for (const auto& [word, figure] : kFigures)
    if (begins(word)) {
      figure_ = figure;
      break;
    }
  if (late_ && !is_figure())
    unknown(spec, text, "late is of a figure", "as in --of \"late mean " + rest + "\"");
  std::vector<std::string> known;
  for (const ObserverSpec& observer : spec.observers) {
    known.push_back(observer.name);
    if (observer.name != rest) continue;
    observer_ = known.size() - 1;
    value_ = observer.value;
  }
  if (value_) return;
  unknown(spec, text, "the scene does not observe '" + rest + "'",
          known.empty() ? "add observe = { NAME = function(s) ... end } to the scene"
          : rest.find(' ') != std::string::npos
              ? "as in --of \"mean " + known.front() + "\": mean, max, min or period"
              : suggestion(rest, known));
}

double Quantity::of(Values times, Values values) const {
  if (values.empty() || !std::ranges::all_of(values, [](double v) { return std::isfinite(v); }))
    return std::nan("");
  double from = times.front();
  if (late_) from += (times.back() - times.front()) / 2;
  if (figure_ == Figure::kMean) return mean(times, values, from);
  const auto begin =
      static_cast<std::size_t>(std::ranges::lower_bound(times, from) - times.begin());
  times = times.subspan(begin);
  values = values.subspan(begin);
  if (figure_ == Figure::kMost) return largest(times, values);
  if (figure_ == Figure::kPeriod) return period(times, values, times.front());
  if (figure_ == Figure::kCourse) return values.back();
  std::vector<double> turned(values.begin(), values.end());
  for (double& value : turned) value = -value;
  return -largest(times, turned);
}

void Course::look(double t, double value) {
  constexpr std::size_t kMost = std::size_t{1} << 20;
  if (!times_.empty() && t <= times_.back()) return;
  if (!last_stays_) {
    times_.pop_back();
    values_.pop_back();
  }
  if (times_.size() == kMost) {
    for (std::size_t i = 0; i < kMost / 2; ++i) {
      times_[i] = times_[2 * i];
      values_[i] = values_[2 * i];
    }
    times_.resize(kMost / 2);
    values_.resize(kMost / 2);
    stride_ *= 2;
  }
  times_.push_back(t);
  values_.push_back(value);
  last_stays_ = looks_++ % stride_ == 0;
}

}  // namespace sim::study
