#include "tests/bench/table.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>

#include "core/base/text.h"

namespace sim_bench {
namespace {

// Columns that `text` takes: bytes that continue a UTF-8 character take none.
std::size_t columns_of(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

std::string padded(const std::string& text, std::size_t width, bool right) {
  const std::string space(width - std::min(width, columns_of(text)), ' ');
  return right ? space + text : text + space;
}

// The words of a note on lines of at most 96 columns, indented by two.
std::string wrapped(const std::string& note) {
  constexpr std::size_t kWidth = 96;
  std::string out, line = " ";
  std::istringstream words(note);
  for (std::string word; words >> word;) {
    if (columns_of(line) + 1 + columns_of(word) > kWidth) {
      out += line + "\n";
      line.assign(1, ' ');
    }
    line += " " + word;
  }
  return out + line + "\n";
}

void strip_end(std::string& line) { line.erase(line.find_last_not_of(' ') + 1); }

}  // namespace

std::vector<std::size_t> Table::widths() const {
  std::vector<std::size_t> widths;
  for (std::size_t c = 0; c < columns_.size(); ++c) {
    widths.push_back(columns_of(columns_[c].head));
    for (const auto& row : rows_) widths[c] = std::max(widths[c], columns_of(row[c]));
  }
  return widths;
}

std::string Table::text() const {
  const auto width = widths();
  std::string out = title_ + "\n";
  const auto add_line = [&](auto cell) {
    std::string line;
    for (std::size_t c = 0; c < columns_.size(); ++c)
      line += (c ? "  " : "") + padded(cell(c), width[c], columns_[c].number);
    strip_end(line);
    out += line + "\n";
  };
  add_line([&](std::size_t c) { return columns_[c].head; });
  for (const auto& row : rows_)
    add_line([&](std::size_t c) { return row[c].empty() ? std::string("-") : row[c]; });
  for (const std::string& note : notes_) out += wrapped(note);
  return out;
}

std::string Table::markdown() const {
  std::string out = "## " + title_ + "\n\n|", rule = "|";
  for (const Column& column : columns_) {
    out += " " + column.head + " |";
    rule += column.number ? "---:|" : "---|";
  }
  out += "\n" + rule + "\n";
  for (const auto& row : rows_) {
    out += "|";
    for (const std::string& cell : row) out += " " + (cell.empty() ? "-" : cell) + " |";
    out += "\n";
  }
  if (!notes_.empty()) out += "\n";
  for (const std::string& note : notes_) out += "- " + note + "\n";
  return out;
}

std::string Table::json() const {
  std::string out = sim::json_string(name_) + ": {\"rows\": [";
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    out += r ? ",\n  {" : "\n  {";
    for (std::size_t c = 0; c < columns_.size(); ++c) {
      const std::string& cell = rows_[r][c];
      const bool number = columns_[c].number && sim::parse_number(cell).has_value();
      out += (c ? ", " : "") + sim::json_string(columns_[c].key) + ": ";
      out += cell.empty() ? "null" : number ? cell : sim::json_string(cell);
    }
    out += "}";
  }
  out += "],\n \"notes\": [";
  for (std::size_t i = 0; i < notes_.size(); ++i)
    out += (i ? ", " : "") + sim::json_string(notes_[i]);
  return out + "]}";
}

std::string short_number(double value) {
  if (!std::isfinite(value)) return "";
  const double size = std::abs(value);
  const int magnitude = size > 0 ? static_cast<int>(std::floor(std::log10(size))) : 0;
  const int digits = std::clamp(2 - magnitude, 0, 6);
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

}  // namespace sim_bench
