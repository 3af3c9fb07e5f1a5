#include "core/report/sweep_cases.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/output/format.h"
#include "core/output/read_file.h"

namespace sim::report {
namespace {

constexpr std::size_t kMostCases = 1'000'000;

[[noreturn]] void bad_axis(const std::string& axis, const std::string& why) {
  throw Error(ErrorKind::kUsage, {"bad value", "--over '" + axis + "'", why,
                                  "as in k=1,2,5, k=1:100:log5, dt=0.01:0.02:lin3 or seed=1..10"});
}

[[noreturn]] void too_many() {
  throw Error(ErrorKind::kUsage, {"too many cases", "--over", "there are more than a million",
                                  "fewer values, or several sweeps"});
}

// LO..HI
std::vector<std::string> whole_numbers(const std::string& axis, const std::string& text,
                                       std::size_t dots) {
  const auto low = parse_integer(text.substr(0, dots)), high = parse_integer(text.substr(dots + 2));
  if (!low || !high || *high < *low) bad_axis(axis, "LO..HI are two whole numbers, LO <= HI");
  if (static_cast<std::uint64_t>(*high) - static_cast<std::uint64_t>(*low) >= kMostCases)
    too_many();
  std::vector<std::string> values;
  for (std::int64_t value = *low; value <= *high; ++value) values.push_back(std::to_string(value));
  return values;
}

// LO:HI:N, LO:HI:linN or LO:HI:logN
std::vector<std::string> steps_between(const std::string& axis, const std::string& text) {
  const std::size_t first = text.find(':'), second = text.find(':', first + 1);
  std::string count_text = text.substr(second + 1);
  const bool factors = count_text.starts_with("log");
  if (factors || count_text.starts_with("lin")) count_text.erase(0, 3);
  const auto low = parse_number(text.substr(0, first)),
             high = parse_number(text.substr(first + 1, second - first - 1));
  const auto count = parse_integer(count_text);
  if (!low || !high || !count || *count < 2) bad_axis(axis, "LO:HI:N has two numbers and N >= 2");
  if (static_cast<std::size_t>(*count) > kMostCases) too_many();
  if (factors && !(*low > 0 && *high > 0)) bad_axis(axis, "factors need numbers above 0");
  std::vector<std::string> values;
  for (std::int64_t i = 0; i < *count; ++i) {
    const double part = static_cast<double>(i) / static_cast<double>(*count - 1);
    double value = factors ? *low * std::pow(*high / *low, part) : *low + part * (*high - *low);
    if (i == *count - 1) value = *high;
    // Twelve digits say what was meant: 0.3 instead of 0.30000000000000004.
    values.push_back(brief(value, 12));
  }
  return values;
}

std::vector<std::string> listed(const std::string& axis, const std::string& text) {
  std::vector<std::string> values;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string word = text.substr(begin, end - begin);
    begin = end + 1;
    if (word.empty()) bad_axis(axis, "a value is missing");
    if (word.find('=') != std::string::npos && word.find(':') == std::string::npos &&
        !values.empty())
      values.back() += "," + word;
    else
      values.push_back(word);
  }
  return values;
}

void check_names(const std::vector<std::string>& names, const std::string& where) {
  std::set<std::string> seen;
  for (const std::string& name : names)
    if (name.empty() || !seen.insert(name).second)
      throw Error(ErrorKind::kUsage,
                  {"bad names of cases", where,
                   name.empty() ? "one has no name" : "'" + name + "' is there twice",
                   "each value of a case has a name of its own"});
}

}  // namespace

bool SweepCases::has(const std::string& name) const {
  return std::ranges::find(names, name) != names.end();
}

SweepCases product_of(const std::vector<std::string>& axes) {
  SweepCases cases;
  cases.rows.emplace_back();
  for (const std::string& axis : axes) {
    const std::size_t equals = axis.find('=');
    if (equals == 0 || equals == std::string::npos) bad_axis(axis, "it is not NAME=VALUES");
    const std::string text = axis.substr(equals + 1);
    const std::size_t dots = text.find("..");
    const bool numbers = std::ranges::count(text, ':') == 2 && text.find(',') == std::string::npos;
    const std::vector<std::string> values = dots != std::string::npos
                                                ? whole_numbers(axis, text, dots)
                                            : numbers ? steps_between(axis, text)
                                                      : listed(axis, text);
    cases.names.push_back(axis.substr(0, equals));
    if (cases.rows.size() * values.size() > kMostCases) too_many();
    std::vector<std::vector<std::string>> rows;
    for (const auto& row : cases.rows)
      for (const std::string& value : values) {
        rows.push_back(row);
        rows.back().push_back(value);
      }
    cases.rows = std::move(rows);
  }
  check_names(cases.names, "--over");
  return cases;
}

SweepCases table_in(const std::string& file) {
  constexpr double kMostBytes = 256e6;
  std::istringstream in(
      read_input_file(file, kMostBytes, "it is a CSV file with the names in its first row"));
  SweepCases cases;
  std::string line;
  if (std::getline(in, line)) cases.names = csv_fields(line);
  for (std::size_t number = 2; std::getline(in, line); ++number) {
    if (line.empty() || line == "\r") continue;
    cases.rows.push_back(csv_fields(line));
    if (cases.rows.back().size() != cases.names.size())
      throw Error(ErrorKind::kUsage,
                  {"bad case", file + ":" + std::to_string(number),
                   "it has " + std::to_string(cases.rows.back().size()) +
                       " values, the first row " + std::to_string(cases.names.size()) + " names",
                   ""});
    if (cases.rows.size() > kMostCases) too_many();
  }
  if (cases.rows.empty())
    throw Error(ErrorKind::kUsage, {"no cases", file, "it has no row below the names", ""});
  return cases;
}

SweepCases cases_in(const std::string& file) {
  SweepCases cases = table_in(file);
  check_names(cases.names, file);
  return cases;
}

}  // namespace sim::report
