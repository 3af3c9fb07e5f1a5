// Quantities over time as SVG.
#include <algorithm>
#include <cmath>

#include "core/base/text.h"
#include "core/output/svg.h"
#include "core/output/svg_parts.h"

namespace sim {
namespace {

constexpr double kTimeWidth = 900, kTimeHeight = 380;
constexpr double kTimeLeft = 74, kTimeEnd = kTimeWidth - 120, kTimeTop = 48,
                 kTimeFloor = kTimeHeight - 50;
constexpr double kSizesHeight = 200;           // of what is below
constexpr std::size_t kMostTimePoints = 1500;  // of a curve: more cannot be seen

struct LinearScale {
  double low = 0, high = 1, from = 0, to = 1, step = 1;

  LinearScale(double least, double most, double begin, double end) : from(begin), to(end) {
    if (!(most > least))
      least -= 0.5 * std::abs(least) + 1e-30, most += 0.5 * std::abs(most) + 1e-30;
    step = std::pow(10, std::floor(std::log10((most - least) / 4)));
    for (const double more : {2.0, 2.5, 2.0})
      if ((most - least) / step > 7) step *= more;
    low = least, high = most;
  }
  double at(double value) const { return from + (to - from) * (value - low) / (high - low); }
};

// The curves of a chart over time, each with its name at its end; `height_of` a value in px.
template <class Height>
std::string time_curves(const std::vector<ChartCurve>& curves, const LinearScale& x,
                        const Height& height_of, double top, double floor) {
  namespace parts = svg_parts;
  std::string out;
  parts::Places names;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const ChartCurve& curve = curves[i];
    const std::string colour = parts::curve_colour(i);
    std::string path;
    double end = 0;
    const std::size_t stride = 1 + curve.points.size() / kMostTimePoints;
    for (std::size_t p = 0; p < curve.points.size(); ++p) {
      const auto& [t, value] = curve.points[p];
      const bool shown = p % stride == 0 || p + 1 == curve.points.size();
      if (!shown || !std::isfinite(t) || !std::isfinite(value)) continue;
      end = height_of(value);
      path += (path.empty() ? "M" : "L") + parts::number(x.at(t)) + " " + parts::number(end);
    }
    if (path.empty()) continue;
    out += "<path d=\"" + path + "\" fill=\"none\" stroke=\"" + colour +
           "\" stroke-width=\"1.8\" stroke-linejoin=\"round\"/>\n";
    const double at = names.beside(kTimeEnd + 8, end, curve.name, top, floor);
    out += parts::text(kTimeEnd + 8, at + 4.5, curve.name,
                       " fill=\"" + colour + "\" font-weight=\"bold\"");
  }
  return out;
}

// The name of an axis of values, upright beside it.
std::string side_name(const std::string& name, double top, double floor) {
  return svg_parts::text(0, 0, name,
                         " text-anchor=\"middle\" transform=\"translate(19 " +
                             svg_parts::number((top + floor) / 2) + ") rotate(-90)\"");
}

// Sizes on decades below a chart: what is too small to be seen above, and too different in size to
// be seen on an even axis. Values of 0 stand on the floor.
std::string sizes_below(const TimeChart& chart, const LinearScale& x) {
  namespace parts = svg_parts;
  constexpr double kSizesTop = kTimeHeight + 16, kSizesFloor = kTimeHeight + kSizesHeight - 24;
  std::vector<double> sizes;
  for (const ChartCurve& curve : chart.sizes)
    for (const auto& [t, value] : curve.points)
      if (value > 0 && std::isfinite(value)) sizes.push_back(value);
  if (sizes.empty()) return "";
  const double least = 1e-8 * *std::ranges::max_element(sizes);
  for (double& size : sizes) size = std::max(size, least);
  const parts::DecadeScale y(sizes, kSizesFloor, kSizesTop);
  std::string out;
  for (double d = std::ceil(y.low); d <= y.high; d += y.every()) {
    const double at = y.at(std::pow(10, d));
    out += parts::line(kTimeLeft, at, kTimeEnd, at, "stroke=\"#e5e7eb\"") +
           parts::decade(kTimeLeft - 8, at + 5, d, "end");
  }
  out += parts::line(kTimeLeft, kSizesFloor, kTimeEnd, kSizesFloor, "stroke=\"#9ca3af\"");
  out += side_name(chart.sizes_name, kSizesTop, kSizesFloor);
  return out + time_curves(
                   chart.sizes, x,
                   [&](double value) { return value > least ? y.at(value) : kSizesFloor; },
                   kSizesTop, kSizesFloor);
}

}  // namespace

std::string svg(const TimeChart& chart) {
  namespace parts = svg_parts;
  std::string out =
      parts::begin(kTimeWidth, kTimeHeight + (chart.sizes.empty() ? 0 : kSizesHeight));
  out += parts::text(kTimeLeft, 28, chart.title,
                     " font-weight=\"bold\" font-size=\"16\" fill=\"#111827\"");
  double first = HUGE_VAL, last = -HUGE_VAL;
  double low = chart.from_zero ? 0 : HUGE_VAL, high = chart.from_zero ? 0 : -HUGE_VAL;
  for (const ChartCurve& curve : chart.curves)
    for (const auto& [t, value] : curve.points) {
      if (!std::isfinite(t) || !std::isfinite(value)) continue;
      first = std::min(first, t), last = std::max(last, t);
      low = std::min(low, value), high = std::max(high, value);
    }
  if (!(first <= last))
    return out + parts::text(kTimeLeft, kTimeHeight / 2, "no points") + "</svg>\n";
  const double room = 0.04 * (high - low);
  const LinearScale x(first, last, kTimeLeft, kTimeEnd),
      y(low - room, high + room, kTimeFloor, kTimeTop);
  for (double k = std::ceil(x.low / x.step); k * x.step <= x.high + 1e-9 * x.step; ++k) {
    const double at = x.at(k * x.step);
    out += parts::line(at, kTimeFloor, at, kTimeFloor + 5, "stroke=\"#9ca3af\"");
    out += parts::text(at, kTimeFloor + 20, brief(k * x.step, 5), " text-anchor=\"middle\"");
  }
  for (double k = std::ceil(y.low / y.step); k * y.step <= y.high; ++k) {
    const double at = y.at(k * y.step);
    out += parts::line(kTimeLeft, at, kTimeEnd, at,
                       k == 0 ? "stroke=\"#9ca3af\"" : "stroke=\"#e5e7eb\"");
    out += parts::text(kTimeLeft - 8, at + 4.5, brief(k * y.step, 5), " text-anchor=\"end\"");
  }
  out += parts::text((kTimeLeft + kTimeEnd) / 2, kTimeHeight - 10, chart.x_name,
                     " text-anchor=\"middle\"");
  out += side_name(chart.y_name, kTimeTop, kTimeFloor);
  out += time_curves(
      chart.curves, x, [&](double value) { return y.at(value); }, kTimeTop, kTimeFloor);
  if (!chart.sizes.empty()) out += sizes_below(chart, x);
  return out + "</svg>\n";
}

}  // namespace sim
