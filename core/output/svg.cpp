#include "core/output/svg.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/output/format.h"

namespace sim {
namespace {

constexpr double kWidth = 900, kHeight = 560;
constexpr double kLeft = 80, kRight = 190, kTop = 40, kBottom = 55;

// Neighbours in the list differ in mark, dash and colour; no two of the first 36 share mark and
// colour.
constexpr std::array<const char*, 4> kDashes = {"", "7 3", "2 3", "9 3 2 3"};
constexpr int kMarks = 6;
constexpr std::array<const char*, 6> kColours = {"#000000", "#b04a00", "#00609c",
                                                 "#5a7d00", "#84308c", "#777777"};

std::string number(double value) { return brief(std::round(100 * value) / 100, 7); }

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '<')
      out += "&lt;";
    else if (c == '&')
      out += "&amp;";
    else
      out += c;
  }
  return out;
}

std::string text_at(double x, double y, const std::string& text, const std::string& more = "") {
  return "<text x=\"" + number(x) + "\" y=\"" + number(y) + "\"" + more + ">" + escaped(text) +
         "</text>\n";
}

std::string line(double x1, double y1, double x2, double y2, const std::string& style) {
  return "<line x1=\"" + number(x1) + "\" y1=\"" + number(y1) + "\" x2=\"" + number(x2) +
         "\" y2=\"" + number(y2) + "\" " + style + "/>\n";
}

// One of: disc, circle, square, open square, triangle, cross.
std::string mark(std::size_t kind, double x, double y, const std::string& colour) {
  constexpr double r = 4;
  const std::string full = " fill=\"" + colour + "\" stroke=\"" + colour + "\"";
  const std::string open = " fill=\"white\" stroke=\"" + colour + "\"";
  const auto circle = [&](const std::string& paint) {
    return "<circle cx=\"" + number(x) + "\" cy=\"" + number(y) + "\" r=\"" + number(r) + "\"" +
           paint + "/>\n";
  };
  const auto square = [&](const std::string& paint) {
    return "<rect x=\"" + number(x - r) + "\" y=\"" + number(y - r) +
           "\" width=\"8\" height=\"8\"" + paint + "/>\n";
  };
  switch (kind % kMarks) {
    case 0:
      return circle(full);
    case 1:
      return square(open);
    case 2:
      return "<path d=\"M" + number(x) + " " + number(y - 5) + "l5 9h-10z\"" + full + "/>\n";
    case 3:
      return circle(open);
    case 4:
      return square(full);
    default:
      return "<path d=\"M" + number(x - r) + " " + number(y - r) + "l8 8m0 -8l-8 8\"" + open +
             "/>\n";
  }
}

// A decade scale from the least to the most value, and where a value stands on it.
struct Scale {
  double low = 0, high = 1, from = 0, to = 1;

  double at(double value) const {
    return from + (to - from) * (std::log10(value) - low) / (high - low);
  }
};

Scale scale_of(std::vector<double> values, double from, double to) {
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  Scale scale{std::floor(std::log10(*least)), std::ceil(std::log10(*most)), from, to};
  if (scale.high <= scale.low) scale.high = scale.low + 1;
  return scale;
}

bool drawable(double value) { return value > 0 && std::isfinite(value); }

std::string axes(const Chart& chart, const Scale& x, const Scale& y) {
  const std::string grid = "stroke=\"#cccccc\" stroke-width=\"0.7\"";
  std::string text;
  const auto every = [](const Scale& scale) { return std::ceil((scale.high - scale.low) / 12); };
  for (double d = x.low; d <= x.high; d += every(x)) {
    const double at = x.at(std::pow(10, d));
    text += line(at, kTop, at, kHeight - kBottom, grid);
    text += text_at(at, kHeight - kBottom + 18, "1e" + brief(d), " text-anchor=\"middle\"");
  }
  for (double d = y.low; d <= y.high; d += every(y)) {
    const double at = y.at(std::pow(10, d));
    text += line(kLeft, at, kWidth - kRight, at, grid);
    text += text_at(kLeft - 8, at + 4, "1e" + brief(d), " text-anchor=\"end\"");
  }
  text +=
      text_at((kLeft + kWidth - kRight) / 2, kHeight - 14, chart.x_name, " text-anchor=\"middle\"");
  const std::string middle = number((kTop + kHeight - kBottom) / 2);
  text += text_at(0, 0, chart.y_name,
                  " text-anchor=\"middle\" transform=\"translate(22 " + middle + ") rotate(-90)\"");
  return text;
}

}  // namespace

std::string svg(const Chart& chart) {
  std::string text = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + number(kWidth) +
                     "\" height=\"" + number(kHeight) + "\" viewBox=\"0 0 " + number(kWidth) + " " +
                     number(kHeight) + "\" font-family=\"sans-serif\" font-size=\"13\">\n" +
                     "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
  text += text_at(kLeft, 24, chart.title, " font-weight=\"bold\"");
  std::vector<double> xs, ys;
  for (const ChartCurve& curve : chart.curves)
    for (const auto& [x, y] : curve.points)
      if (drawable(x) && drawable(y)) {
        xs.push_back(x);
        ys.push_back(y);
      }
  if (xs.empty()) return text + text_at(kLeft, kHeight / 2, "no points") + "</svg>\n";
  for (const ChartLine& each : chart.lines)
    if (drawable(each.y)) ys.push_back(each.y);
  const Scale x = scale_of(xs, kLeft, kWidth - kRight), y = scale_of(ys, kHeight - kBottom, kTop);
  text += axes(chart, x, y);

  for (const ChartLine& each : chart.lines) {
    if (!drawable(each.y)) continue;
    const double at = y.at(each.y);
    text += line(kLeft, at, kWidth - kRight, at, "stroke=\"#444444\" stroke-dasharray=\"1 4\"");
    text += text_at(kWidth - kRight - 4, at - 4, each.name,
                    " text-anchor=\"end\" font-style=\"italic\"");
  }
  double legend = kTop + 8;
  for (std::size_t i = 0; i < chart.curves.size(); ++i) {
    const ChartCurve& curve = chart.curves[i];
    const std::string colour = kColours[(i + i / kMarks) % kColours.size()];
    const std::string stroke = "fill=\"none\" stroke=\"" + colour + "\" stroke-dasharray=\"" +
                               kDashes[(i + i / kMarks) % kDashes.size()] + "\"";
    std::string path, marks;
    for (const auto& [px, py] : curve.points) {
      if (!drawable(px) || !drawable(py)) continue;
      path += (path.empty() ? "M" : "L") + number(x.at(px)) + " " + number(y.at(py));
      marks += mark(i, x.at(px), y.at(py), colour);
    }
    if (path.empty()) continue;
    text += "<path d=\"" + path + "\" " + stroke + "/>\n" + marks;
    const double at = kWidth - kRight + 14;
    text += line(at, legend, at + 30, legend, stroke) + mark(i, at + 15, legend, colour) +
            text_at(at + 38, legend + 4, curve.name);
    legend += 20;
  }
  return text + "</svg>\n";
}

}  // namespace sim
