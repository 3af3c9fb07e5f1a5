// `sim plot TABLE.csv`: one column of a table over another, as a chart.
#pragma once

#include <string>

#include "cli/terminal/console.h"

namespace sim::cli {

struct PlotRequest {
  std::string table;  // a CSV file with names in its first row
  std::string x, y;   // columns
  std::string by;     // a curve for each value of this column; empty: one curve
  std::string out;    // .svg; empty: the table's name with that ending
};

// Logarithmic axes where all numbers are positive and one of them spans a decade, else linear ones.
// Cells that are no number are left out. Throws Error{kUsage}, Error{kIo}.
int plot_table(const PlotRequest& request, Console& console);

}  // namespace sim::cli
