// Text as characters: where it can be cut, how wide it is, and how text of unknown origin is shown.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace sim {

// The character that a text begins with; a byte that begins none stands for itself, without a code.
struct Character {
  std::string_view bytes;
  std::optional<char32_t> code;

  bool visible() const;  // no control character, and no mark that reorders or breaks a line
};
Character first_character(std::string_view text);  // of a text that is not empty

// The length in bytes of the UTF-8 character that a text begins with; 0 for a byte that begins
// none, or where the text ends before the character does.
std::size_t utf8_length(std::string_view text);

// The longest beginning of at most so many bytes that ends with a whole character.
std::string_view utf8_head(std::string_view text, std::size_t most);

// The number of bytes at the end of a text that begin a character without completing it.
std::size_t unfinished_utf8(std::string_view text);

// The number of terminal columns that a text takes: one a character.
std::size_t columns_of(std::string_view text);

// The beginning of a text that takes at most so many of them.
std::string cut_columns(std::string_view text, std::size_t columns);

// Text of unknown origin made fit for a terminal, a page or a picture, always valid UTF-8: control
// characters, marks that reorder text and bytes that are no UTF-8 become \x1b, \u202e, \xff. Line
// ends and tabs stay.
std::string visible_text(std::string_view text);

// ... in one line: line ends and tabs as \x0a and \x09.
std::string visible_line(std::string_view text);

// True if visible_text leaves a text as it is.
bool is_visible(std::string_view text);

}  // namespace sim
