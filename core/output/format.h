// Text for people (aligned, short numbers) and for machines (JSON, CSV).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/text.h"

namespace sim {

// Padded with spaces to the width; longer text stays whole.
std::string left(std::string_view text, std::size_t width);
std::string right(std::string_view text, std::size_t width);

// A line of a summary: the name padded to the width, the text, a newline.
std::string label(std::string_view name, std::string_view text, std::size_t width = 12);

// "  " before each line of a text of one or more lines; ends in a newline.
std::string indented(std::string_view text, std::string_view indent = "  ");

// Breaks text between words into lines of at most `width`, later ones after `indent` spaces; the
// first one after `used` columns.
std::string wrapped(std::string_view text, std::size_t indent, std::size_t used = 0,
                    std::size_t width = 80);

// Rows of texts in columns as wide as they need; the last column is not padded.
std::string aligned(const std::vector<std::vector<std::string>>& rows,
                    std::string_view indent = "  ");

// A field of a CSV row: in quotes if the text needs it.
std::string csv_field(std::string_view text);

// The fields of a row; quotes may hold commas and doubled quotes, not line ends.
std::vector<std::string> csv_fields(std::string_view row);

// {"a":1,"b":"x"}, keys in the order of the calls. A number that is not finite becomes null.
class JsonObject {
 public:
  JsonObject& text(std::string_view key, std::string_view value);
  JsonObject& number(std::string_view key, double value);
  JsonObject& integer(std::string_view key, std::int64_t value);
  JsonObject& flag(std::string_view key, bool value);
  JsonObject& json(std::string_view key, std::string_view value);  // value is JSON already

  std::string str() const { return text_ + "}"; }

 private:
  std::string& key(std::string_view name);

  std::string text_ = "{";
};

std::string json_array(std::span<const std::string> values);  // values are JSON already

}  // namespace sim
