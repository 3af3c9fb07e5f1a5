// A quantity over time as a plot in characters, for a terminal.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace sim {

struct TimeSeries {
  std::string name;                               // of the quantity
  std::vector<std::pair<double, double>> points;  // (t in s, value), t ascending
};

// Lines of at most 79 columns. Points that are not finite are left out; without any it says so.
std::string text_plot(const TimeSeries& series);

}  // namespace sim
