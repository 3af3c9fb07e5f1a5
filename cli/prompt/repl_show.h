// Values as a prompt shows them.
#pragma once

#include <string>

#include "core/lua/data.h"

namespace sim::cli {

enum class Mode { kText, kJson, kCsv };

const char* mode_name(Mode mode);  // "text", "json", "csv"

// A value in Lua's notation: {1, 2, x = "text"}; over several lines if one is too long. Characters
// unfit for a terminal are escaped.
std::string lua_text(const Data& value);

// Numbers that are not finite become null, functions a text.
std::string json_text(const Data& value);

struct CsvText {
  std::string header, rows;  // the header is empty when no names are known
};

// Tables of names become a header and a row, lists of such tables several rows, other lists one
// row.
CsvText csv_text(const Data& value);

}  // namespace sim::cli
