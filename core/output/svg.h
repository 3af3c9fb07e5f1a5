// Charts as SVG: error against cost with decades on both axes, quantities over time, and bars. The
// important curves are coloured, the others grey; labels are at the ends of curves.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace sim {

struct ChartCurve {
  std::string name;
  std::vector<std::pair<double, double>> points;  // both > 0
  bool strong = true;                             // in colour, with a mark at each point
  bool dashed = false;
  std::vector<bool> filled = {};  // marks of points: filled where it says so
};

// A line across the chart at one value of y.
struct ChartLine {
  double y = 0;
  std::string name;
  bool tinted = false;  // the area below it is tinted
};

// A point with a circle around it and a label.
struct ChartRing {
  double x = 0, y = 0;
  std::string name;
};

struct Chart {
  std::string title, subtitle, x_name, y_name;
  std::vector<ChartCurve> curves;
  std::vector<ChartLine> lines;
  std::optional<ChartRing> ring;
  // Orders p whose slopes, y ~ 1 / x^p, are drawn where no curve is; ascending.
  std::vector<int> orders = {};
};

// The whole file. Points that are not finite or not positive are left out; without any the chart is
// empty and says so.
std::string svg(const Chart& chart);

// Some quantities over time, or over something else, on linear axes.
struct TimeChart {
  std::string title, y_name;
  std::vector<ChartCurve> curves;  // (t in s, value); values that are not finite are left out
  bool from_zero = true;           // the axis of values holds 0
  std::string x_name = "t [s]";
  // The sizes of other quantities over the same times, on an axis of decades below.
  std::string sizes_name = {};
  std::vector<ChartCurve> sizes = {};
};

std::string svg(const TimeChart& chart);

// A row of a bar chart: 0 is a row without a bar, infinity one to the end of the chart.
struct ChartBar {
  std::string name, words;  // before the bar and behind it
  double value = 0;
};

// Values >= 0 on an axis of decades, and one value across all of them: bars that do not reach it
// are red, the others green.
struct BarChart {
  std::string title{}, x_name{};
  std::vector<ChartBar> bars{};
  double mark = 0;  // > 0
};

std::string svg(const BarChart& chart);

}  // namespace sim
