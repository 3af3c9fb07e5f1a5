// Plots in characters: every mark and every label.
#include <catch2/catch.hpp>

#include <cmath>

#include "core/output/plot.h"

namespace {

std::vector<std::string> lines_of_plot(const sim::TimeSeries& series) {
  std::vector<std::string> lines(1);
  for (const char c : sim::text_plot(series))
    if (c == '\n')
      lines.emplace_back();
    else
      lines.back() += c;
  return lines;
}

}  // namespace

TEST_CASE("a plot in characters has its marks and labels where its numbers are") {
  sim::TimeSeries series{"height", {}};
  for (int i = 0; i <= 100; ++i) series.points.emplace_back(0.02 * i, 21.0 - 0.42 * i);
  const std::vector<std::string> lines = lines_of_plot(series);
  CHECK(lines[0] == "height");
  // The rows that have an axis, from the highest value down to the lowest.
  std::vector<double> labels;
  std::vector<std::size_t> marks;
  for (const std::string& line : lines) {
    const std::size_t axis = line.find_first_of("|+");
    if (axis == std::string::npos) continue;
    CHECK((line[axis] == '+') == (line.find_first_not_of(' ') < axis));
    if (line[axis] == '+') labels.push_back(std::stod(line.substr(0, axis)));
    REQUIRE(line.find('*') != std::string::npos);
    marks.push_back(line.find('*'));
  }
  REQUIRE(labels.size() >= 3);
  CHECK(labels.front() == Approx(21).epsilon(1e-3));
  CHECK(labels.back() == Approx(-21).epsilon(1e-3));
  for (std::size_t i = 1; i < labels.size(); ++i)
    CHECK(labels[i] - labels[0] ==
          Approx(-42.0 * static_cast<double>(i) / static_cast<double>(labels.size() - 1))
              .margin(0.01));
  // A straight line falls by as many rows a column everywhere.
  CHECK(std::is_sorted(marks.begin(), marks.end()));
  const double step =
      static_cast<double>(marks.back() - marks.front()) / static_cast<double>(marks.size() - 1);
  for (std::size_t i = 0; i < marks.size(); ++i)
    CHECK(std::fabs(static_cast<double>(marks[i] - marks[0]) - step * static_cast<double>(i)) <
          2.5);
  CHECK(lines[lines.size() - 2].find("t = 2 s") != std::string::npos);
}
