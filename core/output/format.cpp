#include "core/output/format.h"
#include "core/base/utf8.h"

#include <algorithm>
#include <cmath>

namespace sim {

std::string left(std::string_view text, std::size_t width) {
  std::string padded(text);
  if (const std::size_t columns = columns_of(text); columns < width)
    padded.append(width - columns, ' ');
  return padded;
}

std::string right(std::string_view text, std::size_t width) {
  const std::size_t columns = columns_of(text);
  return std::string(columns < width ? width - columns : 0, ' ').append(text);
}

std::string label(std::string_view name, std::string_view text, std::size_t width) {
  return left(name, width).append(text) + '\n';
}

std::string indented(std::string_view text, std::string_view indent) {
  std::string out;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    out.append(indent).append(text.substr(0, end)) += '\n';
    text = end == std::string_view::npos ? std::string_view() : text.substr(end + 1);
  }
  return out;
}

std::string wrapped(std::string_view text, std::size_t indent, std::size_t used,
                    std::size_t width) {
  std::string out;
  for (bool first = true; !text.empty(); first = false) {
    const std::size_t space = text.find(' ');
    const std::string_view word = text.substr(0, space);
    const std::size_t columns = columns_of(word);
    if (used > indent && used + 1 + columns > width) {
      out.append(1, '\n').append(indent, ' ');
      used = indent;
    } else if (!first) {
      out += ' ';
      ++used;
    }
    out += word;
    used += columns;
    text = space == std::string_view::npos ? std::string_view() : text.substr(space + 1);
  }
  return out;
}

std::string aligned(const std::vector<std::vector<std::string>>& rows, std::string_view indent) {
  std::vector<std::size_t> width;
  for (const auto& row : rows) {
    width.resize(std::max(width.size(), row.size()));
    for (std::size_t i = 0; i < row.size(); ++i) width[i] = std::max(width[i], columns_of(row[i]));
  }
  std::string text;
  for (const auto& row : rows) {
    std::string line(indent);
    for (std::size_t i = 0; i < row.size(); ++i)
      line += i + 1 < row.size() ? left(row[i], width[i] + 2) : row[i];
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + '\n';
  }
  return text;
}

std::string csv_field(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"') out += '"';
    out += c;
  }
  return out += '"';
}

std::vector<std::string> csv_fields(std::string_view row) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (std::size_t i = 0; i < row.size(); ++i) {
    const char c = row[i];
    if (quoted && c == '"' && i + 1 < row.size() && row[i + 1] == '"')
      fields.back() += row[++i];
    else if (c == '"')
      quoted = !quoted;
    else if (c == ',' && !quoted)
      fields.emplace_back();
    else if (c != '\r')
      fields.back() += c;
  }
  return fields;
}

std::string& JsonObject::key(std::string_view name) {
  if (text_.size() > 1) text_ += ',';
  text_ += json_string(name);
  return text_ += ':';
}

JsonObject& JsonObject::text(std::string_view name, std::string_view value) {
  key(name) += json_string(value);
  return *this;
}

JsonObject& JsonObject::number(std::string_view name, double value) {
  key(name);
  if (std::isfinite(value)) {
    append_number(text_, value);
  } else {
    text_ += "null";
  }
  return *this;
}

JsonObject& JsonObject::integer(std::string_view name, std::int64_t value) {
  key(name) += std::to_string(value);
  return *this;
}

JsonObject& JsonObject::flag(std::string_view name, bool value) {
  key(name) += value ? "true" : "false";
  return *this;
}

JsonObject& JsonObject::json(std::string_view name, std::string_view value) {
  key(name) += value;
  return *this;
}

std::string json_array(std::span<const std::string> values) {
  return "[" + join(values, ",") + "]";
}

}  // namespace sim
