// Words shared by the reports of studies.
#pragma once

#include <optional>
#include <string>

#include "core/study/quantity.h"

namespace sim::report {

// The quantity that --of names, for study::Problem::of; empty for an empty text. Throws
// Error{kUsage} if the scene does not observe it.
std::optional<study::Quantity> quantity(const SystemSpec& spec, const std::string& text);

// "mean sag = 1.234 (known to 0.002)", without meaningless digits; "sag (known to 0.002)" for one
// at all times.
std::string judged_text(const std::string& of, double figure, double error);

// A name as the first cell of a row, padded; a longer one has a line of its own.
std::string first_cell(const std::string& name, std::size_t width);

// "64 particles", "1 spring".
std::string counted(long count, const std::string& noun);

}  // namespace sim::report
