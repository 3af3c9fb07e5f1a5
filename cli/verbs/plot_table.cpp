#include "cli/verbs/plot_table.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/output/file_plan.h"
#include "core/output/output.h"
#include "core/output/svg.h"
#include "core/report/sweep_cases.h"

namespace sim::cli {
namespace {

using report::SweepCases;

constexpr std::size_t kMostCurves = 40;

std::size_t column_of(const SweepCases& table, const std::string& option, const std::string& name) {
  const auto found = std::ranges::find(table.names, name);
  if (found == table.names.end())
    throw Error(ErrorKind::kUsage, {"unknown column", option + " " + name, "the table has no such",
                                    suggestion(name, table.names)});
  return static_cast<std::size_t>(found - table.names.begin());
}

// "a" of "a [m]" and the like stay as they are: the table knows no units.
std::vector<ChartCurve> curves_of(const SweepCases& table, const PlotRequest& request) {
  const std::size_t x = column_of(table, "-x", request.x), y = column_of(table, "-y", request.y);
  const std::size_t by = request.by.empty() ? 0 : column_of(table, "--by", request.by);
  std::vector<ChartCurve> curves;
  for (const auto& row : table.rows) {
    const auto at = parse_number(row[x]), value = parse_number(row[y]);
    if (!at || !value) continue;
    const std::string name = request.by.empty() ? request.y : row[by];
    auto curve = std::ranges::find(curves, name, &ChartCurve::name);
    if (curve == curves.end()) {
      if (curves.size() == kMostCurves)
        throw Error(ErrorKind::kUsage, {"too many curves", "--by " + request.by,
                                        "it has more than 40 values", "another column"});
      curves.push_back({.name = name, .points = {}});
      curve = curves.end() - 1;
    }
    curve->points.emplace_back(*at, *value);
  }
  if (curves.empty())
    throw Error(ErrorKind::kUsage, {"nothing to plot", request.table,
                                    "no row has numbers in both columns", "other columns"});
  for (ChartCurve& curve : curves) std::ranges::sort(curve.points);
  return curves;
}

bool logarithmic(const std::vector<ChartCurve>& curves) {
  double low[2] = {HUGE_VAL, HUGE_VAL}, high[2] = {0, 0};
  for (const ChartCurve& curve : curves)
    for (const auto& [x, y] : curve.points) {
      low[0] = std::min(low[0], x), high[0] = std::max(high[0], x);
      low[1] = std::min(low[1], y), high[1] = std::max(high[1], y);
    }
  return low[0] > 0 && low[1] > 0 && (high[0] > 10 * low[0] || high[1] > 10 * low[1]);
}

}  // namespace

int plot_table(const PlotRequest& request, Console& console) {
  const SweepCases table = report::table_in(request.table);
  const std::vector<ChartCurve> curves = curves_of(table, request);
  const std::filesystem::path source = request.table;
  const std::string out = request.out.empty()
                              ? std::filesystem::path(source).replace_extension(".svg").string()
                              : request.out;
  FilePlan plan;
  plan.reads("the table", request.table);
  plan.writes("--out", out);
  plan.check();
  const std::string title = source.stem().string() + ": " + request.y + " over " + request.x;
  Output file(parse_target("--out", out, true), console.out);
  if (logarithmic(curves)) {
    Chart chart;
    chart.title = title;
    chart.x_name = request.x, chart.y_name = request.y;
    chart.curves = curves;
    file.buffer() = svg(chart);
  } else {
    TimeChart chart;
    chart.title = title;
    chart.x_name = request.x, chart.y_name = request.y;
    chart.curves = curves;
    chart.from_zero = false;
    file.buffer() = svg(chart);
  }
  file.commit();
  console.err << "sim: " << out << '\n' << std::flush;
  return 0;
}

}  // namespace sim::cli
