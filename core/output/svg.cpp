#include "core/output/svg.h"

#include <algorithm>
#include <cmath>

#include "core/base/text.h"
#include "core/output/svg_parts.h"

namespace sim {
namespace {

namespace parts = svg_parts;
using parts::decade, parts::DecadeScale;

constexpr double kWidth = 900, kHeight = 600;
constexpr double kLeft = 74, kRight = 132, kTop = 66, kBottom = 58;
constexpr double kEnd = kWidth - kRight, kFloor = kHeight - kBottom;

bool drawable(double value) { return value > 0 && std::isfinite(value); }

std::string decade_axes(const Chart& chart, const DecadeScale& x, const DecadeScale& y) {
  const std::string grid = "stroke=\"#e5e7eb\"", tick = "stroke=\"#9ca3af\"";
  std::string out;
  for (double d = std::ceil(x.low); d <= x.high; d += x.every()) {
    const double at = x.at(std::pow(10, d));
    out += parts::line(at, kTop, at, kFloor, grid) + decade(at, kFloor + 20, d, "middle");
  }
  for (double d = std::floor(x.low); d <= x.high && x.every() == 1; ++d)
    for (int k = 2; k < 10; ++k)
      if (const double at = x.at(k * std::pow(10, d)); at > kLeft && at < kEnd)
        out += parts::line(at, kFloor, at, kFloor + 4, tick);
  for (double d = std::ceil(y.low); d <= y.high; d += y.every()) {
    const double at = y.at(std::pow(10, d));
    out += parts::line(kLeft, at, kEnd, at, grid) + decade(kLeft - 8, at + 5, d, "end");
  }
  out += parts::line(kLeft, kFloor, kEnd, kFloor, "stroke=\"#6b7280\"");
  out += parts::line(kLeft, kTop, kLeft, kFloor, "stroke=\"#6b7280\"");
  out += parts::text((kLeft + kEnd) / 2, kHeight - 14, chart.x_name, " text-anchor=\"middle\"");
  out += parts::text(0, 0, chart.y_name,
                     " text-anchor=\"middle\" transform=\"translate(19 " +
                         parts::number((kTop + kFloor) / 2) + ") rotate(-90)\"");
  return out;
}

struct DrawnCurve {
  const ChartCurve* curve;
  std::string colour;
  std::vector<std::pair<double, double>> points;  // px
  std::vector<bool> filled;
};

std::string curve_path(const DrawnCurve& drawn) {
  std::string path;
  for (const auto& [x, y] : drawn.points)
    path += (path.empty() ? "M" : "L") + parts::number(x) + " " + parts::number(y);
  const bool strong = drawn.curve->strong;
  return "<path d=\"" + path + "\" fill=\"none\" stroke=\"" + drawn.colour + "\" stroke-width=\"" +
         (strong ? "2.2" : "1.3") + "\"" +
         (drawn.curve->dashed ? " stroke-dasharray=\"5 3\"" : "") + "/>\n";
}

// Words near the ring where least is in their way, with a line to them from further off.
std::string ring(const ChartRing& wanted, const DecadeScale& x, const DecadeScale& y,
                 parts::Places& places) {
  constexpr double kFar = 40, kOnCurve = 20;  // px; px a px^2 that is taken
  const double at_x = x.at(wanted.x), at_y = y.at(wanted.y),
               half = 0.5 * parts::width_of(wanted.name) * 1.08;
  double best_x = at_x, best_y = at_y, least = HUGE_VAL;
  for (double dy = -204; dy <= 204; dy += 12)
    for (const double dx : {half + 16, 0.0, -half - 16, half * 0.6, -half * 0.6}) {
      const double cx = at_x + dx, cy = at_y + dy;
      if (cx - half < kLeft + 4 || cx + half > kWidth - 4 || cy < kTop + 8 || cy > kFloor - 8)
        continue;
      const double crowd = kOnCurve * places.crowd(cx, cy, half, 8) +
                           kOnCurve * kOnCurve * (std::abs(dy) < 17 && std::abs(dx) < half + 9) +
                           0.2 * std::abs(dx) + std::abs(dy);
      if (crowd < least) least = crowd, best_x = cx, best_y = cy;
    }
  places.take(best_x, best_y, half, 8);
  std::string out;
  if (std::abs(best_y - at_y) > kFar)
    out = parts::line(at_x, at_y + (best_y > at_y ? 9 : -9), best_x,
                      best_y + (best_y > at_y ? -9 : 9), "stroke=\"#9ca3af\" stroke-width=\"0.8\"");
  return out + parts::disc(at_x, at_y, 9, "fill=\"none\" stroke=\"#111827\" stroke-width=\"1.8\"") +
         parts::text(best_x, best_y + 4.5, wanted.name,
                     " text-anchor=\"middle\" font-weight=\"bold\" fill=\"#111827\" "
                     "paint-order=\"stroke\" stroke=\"white\" stroke-width=\"4\"");
}

// The left end of words above a horizontal line at height y where they have least in their way, px.
double place_along(const std::string& words, double y, const parts::Places& places) {
  const double half = 0.46 * parts::width_of(words);
  double best = kLeft + 6, least = HUGE_VAL;
  for (double at = kLeft + 6; at + 2 * half < kEnd - 6; at += 12)
    if (const double crowd = places.crowd(at + half, y - 9, half, 8); crowd < least)
      least = crowd, best = at;
  return best;
}

// A fan of slopes from one point, in the box where least is in its way.
std::string slopes(const std::vector<int>& orders, const DecadeScale& x, const DecadeScale& y,
                   parts::Places& places) {
  constexpr double kWide = 84, kHigh = 74, kBelow = 18;
  double left = 0, top = 0, least = HUGE_VAL;
  for (double row = kTop + 26; row + kHigh + kBelow < kFloor - 4; row += 16)
    for (double at = kEnd - kWide - 24; at > kLeft + 12; at -= 16)
      if (const double crowd = places.crowd(at + 0.5 * kWide + 6, row + 0.5 * (kHigh + kBelow) - 12,
                                            0.5 * kWide + 14, 0.5 * (kHigh + kBelow) + 14);
          crowd < least)
        least = crowd, left = at, top = row;
  if (least > 0) return "";  // nowhere without crossing a curve
  const double decade_x = x.at(10) - x.at(1), decade_y = y.at(0.1) - y.at(1);
  std::string out = parts::text(left - 6, top - 8, "slope of order", " font-size=\"11\"");
  for (const int order : orders) {
    const double fall = order * decade_y / decade_x, width = std::min(kWide, kHigh / fall);
    out += parts::line(left, top, left + width, top + fall * width, "stroke=\"#9ca3af\"");
    const bool steep = fall * kWide > kHigh;
    out += parts::text(left + width + (steep ? 0 : 5), top + fall * width + (steep ? 13 : 4),
                       std::to_string(order),
                       std::string(" font-size=\"11\"") + (steep ? " text-anchor=\"middle\"" : ""));
  }
  places.take(left + 0.5 * kWide, top + 0.5 * kHigh, 0.5 * kWide + 12, 0.5 * kHigh + 20);
  return out;
}

}  // namespace

std::string svg(const Chart& chart) {
  std::string out = parts::begin(kWidth, kHeight);
  out += parts::text(kLeft, 28, chart.title,
                     " font-weight=\"bold\" font-size=\"16\" fill=\"#111827\"");
  out += parts::text(kLeft, 49, chart.subtitle, " font-size=\"12\" fill=\"#6b7280\"");
  std::vector<double> xs, ys;
  for (const ChartCurve& curve : chart.curves)
    for (const auto& [x, y] : curve.points)
      if (drawable(x) && drawable(y)) {
        xs.push_back(x);
        ys.push_back(y);
      }
  if (xs.empty()) return out + parts::text(kLeft, kHeight / 2, "no points") + "</svg>\n";
  for (const ChartLine& each : chart.lines)
    if (drawable(each.y)) ys.push_back(each.y);
  const DecadeScale x(xs, kLeft, kEnd), y(ys, kFloor, kTop);

  parts::Places places;
  std::string lines;
  for (const ChartLine& each : chart.lines) {
    if (!drawable(each.y)) continue;
    const double at = y.at(each.y);
    if (each.tinted)
      out += "<rect x=\"" + parts::number(kLeft) + "\" y=\"" + parts::number(at) + "\" width=\"" +
             parts::number(kEnd - kLeft) + "\" height=\"" + parts::number(kFloor - at) +
             "\" fill=\"#15803d\" fill-opacity=\"0.05\"/>\n";
    const std::string colour = each.tinted ? "#15803d" : "#9ca3af";
    lines += parts::line(kLeft, at, kEnd, at, "stroke=\"" + colour + "\" stroke-dasharray=\"4 3\"");
  }
  out += decade_axes(chart, x, y) + lines;

  std::vector<DrawnCurve> drawn;
  std::size_t strong = 0;
  for (const ChartCurve& curve : chart.curves) {
    DrawnCurve one{&curve, curve.strong ? parts::curve_colour(strong) : "#b6bbc4", {}, {}};
    for (std::size_t i = 0; i < curve.points.size(); ++i) {
      const auto& [px, py] = curve.points[i];
      if (!drawable(px) || !drawable(py)) continue;
      one.points.emplace_back(x.at(px), y.at(py));
      one.filled.push_back(i < curve.filled.size() && curve.filled[i]);
    }
    if (one.points.empty()) continue;
    strong += curve.strong;
    drawn.push_back(std::move(one));
  }
  // Strong curves are drawn last, on top; their labels are placed first.
  std::ranges::stable_sort(drawn, {}, [](const DrawnCurve& d) { return d.curve->strong; });
  for (const DrawnCurve& d : drawn) {
    out += curve_path(d);
    for (std::size_t i = 0; i < d.points.size(); ++i) {
      const auto& [px, py] = d.points[i];
      if (d.curve->strong) places.take(px, py, 5, 5);
      if (i == 0) continue;
      const auto& [bx, by] = d.points[i - 1];
      const double pieces = std::ceil(std::hypot(px - bx, py - by) / 4);
      for (double k = 1; k < pieces; ++k)  // the line from the point before
        places.take(px + (bx - px) * k / pieces, py + (by - py) * k / pieces, 2, 2);
    }
  }
  for (const DrawnCurve& d : drawn)
    for (std::size_t i = 0; i < d.points.size() && d.curve->strong; ++i)
      out += parts::disc(d.points[i].first, d.points[i].second, d.filled[i] ? 4.6 : 2.8,
                         "fill=\"" + (d.filled[i] ? d.colour : "white") + "\" stroke=\"" +
                             d.colour + "\" stroke-width=\"1.6\"");
  for (const ChartLine& each : chart.lines) {
    if (!drawable(each.y)) continue;
    const double at = y.at(each.y), left = place_along(each.name, at, places);
    out += parts::text(
        left, at - 5, each.name,
        std::string(" font-size=\"12\" fill=\"") + (each.tinted ? "#15803d" : "#9ca3af") + "\"");
    places.take(left + 0.46 * parts::width_of(each.name), at - 9, 0.46 * parts::width_of(each.name),
                7);
  }
  std::ranges::reverse(drawn);
  for (const DrawnCurve& d : drawn) {
    const auto& [px, py] = *std::ranges::max_element(d.points);
    const double left = std::min(px + 8, kWidth - 4 - parts::width_of(d.curve->name));
    const double at = places.beside(left, py, d.curve->name, kTop + 4, kFloor - 4);
    if (std::abs(at - py) > 9)
      out += parts::line(px + 2, py, left - 2, at, "stroke=\"#d1d5db\" stroke-width=\"0.8\"");
    out += parts::text(left, at + 4.5, d.curve->name,
                       " fill=\"" + (d.curve->strong ? d.colour : "#7b828e") + "\"" +
                           (d.curve->strong ? " font-weight=\"bold\"" : "") +
                           " paint-order=\"stroke\" stroke=\"white\" stroke-width=\"3\"");
  }
  if (chart.ring && drawable(chart.ring->x) && drawable(chart.ring->y))
    out += ring(*chart.ring, x, y, places);
  if (!chart.orders.empty()) out += slopes(chart.orders, x, y, places);
  return out + "</svg>\n";
}

}  // namespace sim
