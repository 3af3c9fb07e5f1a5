// Where the verbs write: data to `out`, words to `err`.
#pragma once

#include <exception>
#include <ostream>
#include <string_view>

#include "core/base/error.h"

namespace sim::cli {

struct Console {
  std::ostream& out;
  std::ostream& err;
  bool err_is_terminal = false;
};

// Thrown when the reader of a pipe has gone away: nobody is left to be told.
struct ClosedPipe : std::exception {};

// The standard streams of a program that begins: called once, first of all in main. One that was
// closed must not become a file that is opened later; writing to what stands in for it fails. A
// closed pipe is met as a failed write, so that half-written files are cleaned up.
Console standard_console();

// Writes and flushes; what goes wrong stays in the stream's state and in errno.
void put(std::ostream& stream, std::string_view text);

// Flushes; throws ClosedPipe, or Error{kIo} when what was written so far did not arrive.
void flush_or_throw(std::ostream& stream, std::string_view name);

// "sim: error: WHAT: WHERE: WHY; REMEDY" in one line, control characters made visible.
void print_error(std::ostream& err, std::string_view message);

// The exit code of the exception being handled; its error line goes to err. Called in a catch.
int report_exception(std::ostream& err);

}  // namespace sim::cli
