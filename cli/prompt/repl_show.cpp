#include "cli/prompt/repl_show.h"

#include <algorithm>
#include <cmath>

#include "core/base/text.h"
#include "core/lua/lua_keywords.h"
#include "core/output/format.h"

namespace sim::cli {
namespace {

constexpr std::size_t kWidth = 78;

// Bytes of the UTF-8 character at the front of the text; 0 when it is none.
std::size_t utf8_length(std::string_view text) {
  const auto lead = static_cast<unsigned char>(text[0]);
  const std::size_t length = lead < 0x80                   ? 1
                             : lead >= 0xc2 && lead < 0xe0 ? 2
                             : lead >= 0xe0 && lead < 0xf0 ? 3
                             : lead >= 0xf0 && lead < 0xf5 ? 4
                                                           : 0;
  if (length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i)
    if ((static_cast<unsigned char>(text[i]) & 0xc0) != 0x80) return 0;
  // The controls after ASCII, too long forms and surrogates.
  const auto second = length > 1 ? static_cast<unsigned char>(text[1]) : 0;
  if ((lead == 0xc2 && second < 0xa0) || (lead == 0xe0 && second < 0xa0) ||
      (lead == 0xed && second >= 0xa0) || (lead == 0xf0 && second < 0x90) ||
      (lead == 0xf4 && second >= 0x90))
    return 0;
  return length;
}

std::string quoted_text(std::string_view text) {
  constexpr std::string_view kHex = "0123456789abcdef";
  std::string out = "\"";
  while (!text.empty()) {
    const char c = text[0];
    const auto byte = static_cast<unsigned char>(c);
    const std::size_t length = utf8_length(text);
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (c == '\n') {
      out += "\\n";
    } else if (c == '\t') {
      out += "\\t";
    } else if (length == 0 || byte < 0x20 || byte == 0x7f) {
      out += "\\x";
      out += kHex[byte >> 4];
      out += kHex[byte & 15];
    } else {
      out += text.substr(0, length);
    }
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return out += '"';
}

std::string number_text(double value) {
  std::string text = shortest(value);
  if (std::isfinite(value) && text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

std::string scalar(const Data& value) {
  struct Show {
    std::string operator()(std::monostate) const { return "nil"; }
    std::string operator()(bool flag) const { return flag ? "true" : "false"; }
    std::string operator()(std::int64_t number) const { return std::to_string(number); }
    std::string operator()(double number) const { return number_text(number); }
    std::string operator()(const std::string& text) const { return quoted_text(text); }
    std::string operator()(const DataFunction&) const { return "<function>"; }
    std::string operator()(const DataOpaque& words) const { return "<" + words.text + ">"; }
    std::string operator()(const std::shared_ptr<const DataTable>&) const { return ""; }
  };
  return std::visit(Show{}, value.value);
}

std::string key_text(const Data& key) {
  const auto* text = std::get_if<std::string>(&key.value);
  if (text && is_lua_name(*text)) return *text;
  return "[" + scalar(key) + "]";
}

std::string render(const Data& value, std::size_t indent) {
  const DataTable* table = value.table();
  if (!table) return scalar(value);
  std::vector<std::string> parts;
  bool nested = false;
  for (const Data& entry : table->list) {
    nested |= entry.table() != nullptr;
    parts.push_back(render(entry, indent + 2));
  }
  for (const auto& [key, entry] : table->fields) {
    nested = true;
    const std::string name = key_text(key) + " = ";
    parts.push_back(name + render(entry, indent + 2));
  }
  if (table->left_out > 0) parts.push_back("... " + std::to_string(table->left_out) + " more");
  const std::string line = "{" + join(parts, ", ") + "}";
  if (indent + line.size() <= kWidth && line.find('\n') == std::string::npos) return line;

  // Names and tables get a line each, plain lists are wrapped.
  const std::string margin(indent + 2, ' ');
  std::string text = "{\n" + margin;
  std::size_t used = margin.size();
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const bool last = i + 1 == parts.size();
    if (i > 0 && (nested || used + parts[i].size() + 2 > kWidth)) {
      text += '\n' + margin;
      used = margin.size();
    } else if (i > 0) {
      text += ' ';
      ++used;
    }
    text += parts[i] + (last ? "" : ",");
    used += parts[i].size() + 1;
  }
  return text + '\n' + std::string(indent, ' ') + '}';
}

// Text as it stands in JSON: bytes that are no UTF-8 become the replacement character.
std::string json_of_text(std::string_view text) {
  std::string clean;
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    const bool control = text.size() > 1 && static_cast<unsigned char>(text[0]) == 0xc2;
    if (length == 0 && control) {  // U+0080 to U+009F are legal in JSON
      clean += text.substr(0, 2);
      text.remove_prefix(2);
      continue;
    }
    clean += length == 0 ? "\xEF\xBF\xBD" : text.substr(0, length);
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return json_string(clean);
}

std::string csv_cell(const Data& value) {
  if (value.nil()) return "";
  if (const auto* text = std::get_if<std::string>(&value.value)) return csv_field(*text);
  if (const auto* number = std::get_if<double>(&value.value)) return shortest(*number);
  return csv_field(value.table() ? json_text(value) : scalar(value));
}

// The names of a table that has names alone.
std::vector<std::string> names_of(const Data& value) {
  const DataTable* table = value.table();
  std::vector<std::string> names;
  if (table && table->list.empty())
    for (const auto& [key, entry] : table->fields)
      names.push_back(std::holds_alternative<std::string>(key.value)
                          ? std::get<std::string>(key.value)
                          : scalar(key));
  return names;
}

std::string csv_row(const DataTable& table) {
  std::vector<std::string> cells;
  for (const Data& entry : table.list) cells.push_back(csv_cell(entry));
  for (const auto& [key, entry] : table.fields) cells.push_back(csv_cell(entry));
  return join(cells, ",") + "\n";
}

std::string csv_header(std::vector<std::string> names) {
  for (std::string& name : names) name = csv_field(name);
  return join(names, ",") + "\n";
}

}  // namespace

const char* mode_name(Mode mode) {
  constexpr const char* kNames[] = {"text", "json", "csv"};
  return kNames[static_cast<int>(mode)];
}

std::string lua_text(const Data& value) { return render(value, 0); }

std::string json_text(const Data& value) {
  if (const auto* number = std::get_if<double>(&value.value))
    return std::isfinite(*number) ? shortest(*number) : "null";
  if (value.nil()) return "null";
  if (const auto* text = std::get_if<std::string>(&value.value)) return json_of_text(*text);
  if (const auto* words = std::get_if<DataOpaque>(&value.value)) return json_of_text(words->text);
  const DataTable* table = value.table();
  if (!table) return scalar(value);
  std::vector<std::string> parts;
  if (table->fields.empty()) {
    for (const Data& entry : table->list) parts.push_back(json_text(entry));
    return json_array(parts);
  }
  for (std::size_t i = 0; i < table->list.size(); ++i)
    parts.push_back(json_string(std::to_string(i + 1)) + ":" + json_text(table->list[i]));
  for (const auto& [key, entry] : table->fields) {
    const auto* text = std::get_if<std::string>(&key.value);
    parts.push_back(json_of_text(text ? *text : scalar(key)) + ":" + json_text(entry));
  }
  return "{" + join(parts, ",") + "}";
}

CsvText csv_text(const Data& value) {
  const DataTable* table = value.table();
  if (!table) return {"", csv_cell(value) + "\n"};
  if (table->list.empty()) return {csv_header(names_of(value)), csv_row(*table)};
  const bool all_tables = std::all_of(table->list.begin(), table->list.end(),
                                      [](const Data& entry) { return entry.table() != nullptr; });
  if (!all_tables || !table->fields.empty()) return {"", csv_row(*table)};
  const std::vector<std::string> names = names_of(table->list.front());
  CsvText text{names.empty() ? "" : csv_header(names), ""};
  for (const Data& entry : table->list)
    text.rows += names_of(entry) == names ? csv_row(*entry.table()) : csv_cell(entry) + "\n";
  return text;
}

}  // namespace sim::cli
