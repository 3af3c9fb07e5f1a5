#include "core/output/plot.h"

#include <algorithm>
#include <cmath>

#include "core/output/format.h"

namespace sim {
namespace {

using Points = std::vector<std::pair<double, double>>;

struct Frame {
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
Frame frame_of(const Points& points) {
  Frame frame{points.front().first, points.back().first, HUGE_VAL, -HUGE_VAL};
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

// 1, 2 or 5 times a power of ten, some five of them in the range.
double tick_step(double range) {
  const double raw = range / 5, power = std::pow(10, std::floor(std::log10(raw)));
  const double times = raw / power;
  return power * (times < 1.5 ? 1 : times < 3.5 ? 2 : times < 7.5 ? 5 : 10);
}

std::vector<double> ticks(double from, double to) {
  const double step = tick_step(to - from);
  std::vector<double> list;
  for (double k = std::ceil(from / step); k * step <= to * (1 + 1e-12) && list.size() < 20; ++k)
    list.push_back(k * step);
  return list;
}

std::string plain(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '<' ? "&lt;" : c == '&' ? "&amp;" : std::string(1, c);
  return out;
}

}  // namespace

std::string text_plot(const TimeSeries& series) {
  constexpr int kColumns = 66, kRows = 15;
  constexpr std::size_t kLabel = 11;
  const Points points = finite_points(series.points);
  if (points.empty()) return series.name + ": nothing to plot\n";
  const Frame frame = frame_of(points);
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

std::string svg_plot(const TimeSeries& series) {
  constexpr double kWidth = 720, kHeight = 420, kLeft = 90, kRight = 20, kTop = 40, kBottom = 50;
  const Points points = finite_points(series.points);
  const Frame frame = points.empty() ? Frame{} : frame_of(points);
  const auto x = [&](double t) { return kLeft + frame.x(t) * (kWidth - kLeft - kRight); };
  const auto y = [&](double v) {
    return kHeight - kBottom - frame.y(v) * (kHeight - kTop - kBottom);
  };
  const auto at = [](double value) { return brief(std::round(100 * value) / 100, 7); };
  const auto label = [&](double px, double py, const char* anchor, const std::string& text) {
    return "<text x=\"" + at(px) + "\" y=\"" + at(py) + "\" text-anchor=\"" + anchor + "\">" +
           plain(text) + "</text>\n";
  };
  const auto line = [&](double x1, double y1, double x2, double y2) {
    return "<line x1=\"" + at(x1) + "\" y1=\"" + at(y1) + "\" x2=\"" + at(x2) + "\" y2=\"" +
           at(y2) + "\" stroke=\"#cccccc\"/>\n";
  };
  std::string text =
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 720 420\" width=\"720\" "
      "height=\"420\" font-family=\"sans-serif\" font-size=\"13\">\n"
      "<rect width=\"720\" height=\"420\" fill=\"white\"/>\n" +
      label(kWidth / 2, 24, "middle", series.name);
  for (const double t : ticks(frame.left, frame.right))
    text += line(x(t), kTop, x(t), kHeight - kBottom) +
            label(x(t), kHeight - kBottom + 18, "middle", brief(t, 6));
  for (const double value : ticks(frame.bottom, frame.top))
    text += line(kLeft, y(value), kWidth - kRight, y(value)) +
            label(kLeft - 8, y(value) + 4, "end", brief(value, 6));
  text += label(kWidth / 2, kHeight - 10, "middle", points.empty() ? "nothing to plot" : "t [s]");
  std::string path;
  for (const auto& [t, value] : points)
    path += (path.empty() ? "" : " ") + at(x(t)) + "," + at(y(value));
  return text + "<polyline fill=\"none\" stroke=\"#00609c\" stroke-width=\"1.5\" points=\"" + path +
         "\"/>\n</svg>\n";
}

}  // namespace sim
