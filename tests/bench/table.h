// Results as tables: printed for people, as markdown, or as JSON, from the same cells.
#pragma once

#include <string>
#include <vector>

namespace sim_bench {

struct Column {
  std::string head;  // what the table prints
  std::string key;   // name of the field in JSON
  bool number = true;
};

class Table {
 public:
  Table(std::string name, std::string title, std::vector<Column> columns)
      : name_(std::move(name)), title_(std::move(title)), columns_(std::move(columns)) {}

  // One cell a column; "" for a value that does not exist (null in JSON).
  void add(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }
  // A remark below the table; text() breaks it into lines.
  void note(std::string text) { notes_.push_back(std::move(text)); }

  bool empty() const { return rows_.empty(); }
  std::string text() const;
  std::string markdown() const;
  std::string json() const;  // "name": {"rows": [{...}, ...], "notes": [...]}

 private:
  std::vector<std::size_t> widths() const;

  std::string name_, title_;
  std::vector<Column> columns_;
  std::vector<std::vector<std::string>> rows_;
  std::vector<std::string> notes_;
};

// Three significant digits without an exponent: 0.0123, 1.23, 12.3, 1230.
std::string short_number(double value);

}  // namespace sim_bench
