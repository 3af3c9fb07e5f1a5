// Bars as SVG.
#include <algorithm>
#include <cmath>

#include "core/output/svg.h"
#include "core/output/svg_parts.h"

namespace sim {
namespace {

constexpr double kBarWidth = 760, kBarLeft = 150, kBarEnd = kBarWidth - 110;
constexpr double kBarTop = 48, kRowHeight = 18;

bool has_length(double value) { return value > 0 && std::isfinite(value); }

}  // namespace

std::string svg(const BarChart& chart) {
  namespace parts = svg_parts;
  const double floor = kBarTop + kRowHeight * static_cast<double>(chart.bars.size()) + 4,
               height = floor + 46;
  std::string out = parts::begin(kBarWidth, height);
  out +=
      parts::text(20, 28, chart.title, " font-weight=\"bold\" font-size=\"16\" fill=\"#111827\"");
  std::vector<double> values{chart.mark};
  for (const ChartBar& bar : chart.bars)
    if (has_length(bar.value)) values.push_back(bar.value);
  const parts::DecadeScale x(values, kBarLeft, kBarEnd);
  for (double d = std::ceil(x.low); d <= x.high; d += x.every()) {
    const double at = x.at(std::pow(10, d));
    out += parts::line(at, kBarTop, at, floor, "stroke=\"#e5e7eb\"") +
           parts::decade(at, floor + 18, d, "middle");
  }

  double y = kBarTop + 2;
  for (const ChartBar& bar : chart.bars) {
    const double end = has_length(bar.value) ? x.at(bar.value) : bar.value > 0 ? kBarEnd : kBarLeft;
    out += parts::text(kBarLeft - 8, y + 12, bar.name, " text-anchor=\"end\"");
    if (end > kBarLeft)
      out += "<rect x=\"" + parts::number(kBarLeft) + "\" y=\"" + parts::number(y) + "\" width=\"" +
             parts::number(end - kBarLeft) + "\" height=\"" + parts::number(kRowHeight - 5) +
             "\" fill=\"" + (bar.value < chart.mark ? "#b91c1c" : "#15803d") +
             "\" fill-opacity=\"0.75\"/>\n";
    out += parts::text(end + 6, y + 11, bar.words, " font-size=\"11\" fill=\"#6b7280\"");
    y += kRowHeight;
  }
  const double mark = x.at(chart.mark);
  out += parts::line(mark, kBarTop - 6, mark, floor, "stroke=\"#111827\" stroke-width=\"1.5\"");
  out += parts::text(kBarLeft, height - 10, chart.x_name);
  return out + "</svg>\n";
}

}  // namespace sim
