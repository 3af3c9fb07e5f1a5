// Numbers and names as text: exact, independent of the locale, strict.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace sim {

// The shortest decimal that reads back as the same double ("0.1", "1e-09", "nan", "inf").
std::string shortest(double value);

// For people: "0.176777", "1.2e-07"; "0" for either zero.
std::string brief(double value, int digits = 6);

// "1.23 %" of the whole; "0 %" of nothing.
std::string percent(double part, double whole = 1, int digits = 3);

// Appends shortest(value) to out without a temporary.
void append_number(std::string& out, double value);

// The whole of `text` as a finite double; nothing for trailing text, nan, inf or overflow.
std::optional<double> parse_number(std::string_view text);

// The whole of `text` as a decimal integer; nothing for anything else or out of range.
std::optional<std::int64_t> parse_integer(std::string_view text);

// The known name nearest to a misspelt one (edit distance at most a third of its length, at least
// one); empty when none is near.
std::string nearest(std::string_view name, std::span<const std::string> known);

// "did you mean 'X'?" for the nearest known name, else "known: A, B, C".
std::string suggestion(std::string_view name, std::span<const std::string> known);

std::string join(std::span<const std::string> texts, std::string_view between);

// The text as a JSON string, quotes included.
std::string json_string(std::string_view text);

}  // namespace sim
