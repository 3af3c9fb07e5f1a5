#include "tests/support/table.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace sim_test {

namespace {

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream in(line);
  for (std::string cell; std::getline(in, cell, ',');) cells.push_back(cell);
  if (line.ends_with(',')) cells.emplace_back();
  return cells;
}

}  // namespace

const std::string& Row::text(const std::string& column) const {
  const auto place = std::find(columns_->begin(), columns_->end(), column);
  if (place == columns_->end()) throw std::runtime_error("no column " + column);
  return cells_.at(static_cast<std::size_t>(place - columns_->begin()));
}

double Row::number(const std::string& column) const {
  const std::string& cell = text(column);
  char* end = nullptr;
  const double value = std::strtod(cell.c_str(), &end);
  if (cell.empty() || *end) throw std::runtime_error("no number: " + cell);
  return value;
}

Table::Table(const std::string& file) {
  const std::string path = std::string(SIM_SOURCE_DIR) + "/tests/reference/" + file;
  std::ifstream in(path);
  if (!in) throw std::runtime_error("cannot read " + path);
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#') continue;
    if (columns_.empty()) {
      columns_ = split(line);
      continue;
    }
    std::vector<std::string> cells = split(line);
    if (cells.size() != columns_.size()) throw std::runtime_error(path + ": bad row " + line);
    rows_.emplace_back(&columns_, std::move(cells));
  }
  if (rows_.empty()) throw std::runtime_error(path + ": no rows");
}

std::vector<Row> Table::rows_where(const std::string& column, double value) const {
  std::vector<Row> found;
  for (const Row& row : rows_)
    if (row.number(column) == value) found.push_back(row);
  if (found.empty()) throw std::runtime_error("no row with that " + column);
  return found;
}

}  // namespace sim_test
