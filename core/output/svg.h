// A log-log chart as SVG, told apart by marks and dashes, so that it also reads on grey paper.
#pragma once

#include <string>
#include <vector>

namespace sim {

struct ChartCurve {
  std::string name;
  std::vector<std::pair<double, double>> points;  // both > 0
};

// A line across the chart at one value of y.
struct ChartLine {
  double y = 0;
  std::string name;
};

struct Chart {
  std::string title, x_name, y_name;
  std::vector<ChartCurve> curves;
  std::vector<ChartLine> lines;
};

// The whole file. Points that are not finite or not positive are left out; without any the chart is
// empty and says so.
std::string svg(const Chart& chart);

}  // namespace sim
