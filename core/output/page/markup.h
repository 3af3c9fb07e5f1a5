// Text in pages and pictures: the only functions that write it there, since the text of a scene may
// be a stranger's.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace sim {

// Text between the tags of HTML or SVG, or in a quoted attribute. Characters that XML does not
// allow, control characters and bytes that are not UTF-8, are shown as \x1b.
std::string markup_text(std::string_view text);

// JSON in a script element: the same values, without a character that HTML reads.
std::string script_json(std::string_view json);

// A page with its placeholders @NAME@ filled in, in one pass: nothing is replaced in a value. A
// name that has no value stays.
using PlaceholderValue = std::pair<std::string_view, std::string_view>;
std::string fill_placeholders(std::string_view page, const std::vector<PlaceholderValue>& values);

}  // namespace sim
