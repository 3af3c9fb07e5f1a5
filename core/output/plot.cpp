#include "core/output/plot.h"

#include <algorithm>
#include <cmath>

#include "core/output/format.h"

namespace sim {
namespace {

using Points = std::vector<std::pair<double, double>>;

struct PlotFrame {
  double left = 0, right = 1, bottom = 0, top = 1;

  double x(double t) const { return (t - left) / (right - left); }  // 0 .. 1
  double y(double value) const { return (value - bottom) / (top - bottom); }
};

Points finite_points(const Points& points) {
  Points kept;
  for (const auto& [t, value] : points)
    if (std::isfinite(t) && std::isfinite(value)) kept.emplace_back(t, value);
  return kept;
}

// Around all points; a constant has room above and below.
PlotFrame frame_of(const Points& points) {
  PlotFrame frame{points.front().first, points.back().first, HUGE_VAL, -HUGE_VAL};
  for (const auto& [t, value] : points) {
    frame.bottom = std::min(frame.bottom, value);
    frame.top = std::max(frame.top, value);
  }
  if (!(frame.right > frame.left)) frame.right = frame.left + 1;
  if (!(frame.top > frame.bottom)) {
    const double room = frame.top == 0 ? 1 : 0.1 * std::abs(frame.top);
    frame.bottom -= room;
    frame.top += room;
  }
  return frame;
}

}  // namespace

std::string text_plot(const TimeSeries& series) {
  constexpr int kColumns = 66, kRows = 15;
  constexpr std::size_t kLabel = 11;
  const Points points = finite_points(series.points);
  if (points.empty()) return series.name + ": nothing to plot\n";
  const PlotFrame frame = frame_of(points);
  std::vector<std::string> rows(kRows, std::string(kColumns, ' '));
  const auto column = [&](double t) {
    return std::clamp(static_cast<int>(std::lround(frame.x(t) * (kColumns - 1))), 0, kColumns - 1);
  };
  const auto row = [&](double value) {
    const int up = static_cast<int>(std::lround(frame.y(value) * (kRows - 1)));
    return static_cast<std::size_t>(kRows - 1 - std::clamp(up, 0, kRows - 1));
  };
  if (frame.bottom < 0 && frame.top > 0) rows[row(0)] = std::string(kColumns, '-');
  // The line between two points, a mark a column.
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto& [t0, a] = points[i == 0 ? 0 : i - 1];
    const auto& [t1, b] = points[i];
    const int from = column(t0), to = column(t1);
    for (int c = from; c <= to; ++c) {
      const double share = to > from ? static_cast<double>(c - from) / (to - from) : 1;
      rows[row(a + share * (b - a))][static_cast<std::size_t>(c)] = '*';
    }
  }
  std::string text = series.name + "\n";
  for (int r = 0; r < kRows; ++r) {
    const double value = frame.top - (frame.top - frame.bottom) * r / (kRows - 1);
    const bool labelled = r % 7 == 0;
    std::string line = right(labelled ? brief(value, 4) : "", kLabel) + (labelled ? " +" : " |") +
                       rows[static_cast<std::size_t>(r)];
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  const std::string first = brief(frame.left, 4), last = "t = " + brief(frame.right, 4) + " s";
  return text + std::string(kLabel + 2, ' ') + first +
         right(last, static_cast<std::size_t>(kColumns) - first.size()) + "\n";
}

}  // namespace sim
