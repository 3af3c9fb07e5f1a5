// Reference numbers: the CSV files of tests/reference.
#pragma once

#include <string>
#include <vector>

namespace sim_test {

// One row; cells are asked for by the name of their column.
class Row {
 public:
  Row(const std::vector<std::string>* columns, std::vector<std::string> cells)
      : columns_(columns), cells_(std::move(cells)) {}

  // Both throw std::runtime_error for a column that is not there or a cell that is no number.
  const std::string& text(const std::string& column) const;
  double number(const std::string& column) const;

 private:
  const std::vector<std::string>* columns_;
  std::vector<std::string> cells_;
};

// A file of tests/reference: lines of '#' are comments, the first other line names the columns.
class Table {
 public:
  explicit Table(const std::string& file);
  Table(const Table&) = delete;
  Table& operator=(const Table&) = delete;

  const std::vector<Row>& rows() const { return rows_; }
  // The rows whose `column` is exactly `value`.
  std::vector<Row> rows_where(const std::string& column, double value) const;

 private:
  std::vector<std::string> columns_;
  std::vector<Row> rows_;
};

}  // namespace sim_test
