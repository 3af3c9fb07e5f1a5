// A run in the terminal: half blocks in 24-bit or 256 colours, drawn over each other while it goes.
#pragma once

#include <memory>
#include <string>

#include "core/output/writer.h"

namespace sim::cli {

inline constexpr double kShowRate = 20;  // pictures a second, of the run and of the clock

// The reason why standard output cannot show pictures: "it is not a terminal"; "" where it can.
std::string cannot_show();

// Shows no more than kShowRate pictures a second, and no moment before its time by the clock.
std::unique_ptr<Writer> make_terminal_view(const WriterTask& task);

}  // namespace sim::cli
