// The output streams of the verbs: data to `out`, words to `err`.
#pragma once

#include <ostream>
#include <streambuf>
#include <string>
#include <string_view>

#include "core/base/error.h"
#include "core/output/stream.h"

namespace sim::cli {

// Passes text on to a standard stream as visible_text: whatever a scene, file or path of unknown
// origin brings, a terminal gets nothing but characters. A character split between writes stays
// whole.
class VisibleBuffer final : public std::streambuf {
 public:
  explicit VisibleBuffer(std::streambuf& inner) : inner_(inner) {}

  // The program's own sequences for the terminal.
  bool put_raw(std::string_view text);

 protected:
  int_type overflow(int_type c) override;
  std::streamsize xsputn(const char* text, std::streamsize size) override;
  int sync() override { return inner_.pubsync(); }

 private:
  std::streambuf& inner_;
  std::string piece_;  // the beginning of a character
};

// Writes a sequence that the program itself sends to the terminal.
void put_control(std::ostream& stream, std::string_view sequence);

struct Console {
  std::ostream& out;
  std::ostream& err;
  bool err_is_terminal = false;
  bool one_place = false;  // both go to the same terminal, file or pipe
};

// The standard streams of a program that begins: called once, first of all in main. One that was
// closed must not become a file that is opened later; writing to what stands in for it fails. A
// closed pipe is met as a failed write, so that half-written files are cleaned up. When memory runs
// out where nothing can be thrown, the program ends with the words and the code of std::bad_alloc.
// The streams show text only (VisibleBuffer).
Console standard_console();

// "sim: error: WHAT: WHERE: WHY; REMEDY" in one line, as visible_line.
void print_error(std::ostream& err, std::string_view message);

// Ends the program with the error of a scene: Lua has used up its budget, and nothing else ends it.
[[noreturn]] void end_overrun(const ErrorText& why);

inline constexpr int kClosedPipe = 141;  // 128 + SIGPIPE, as a shell reports it

// The exit code of the exception being handled; its error line goes to err. Called in a catch.
int report_exception(std::ostream& err);

}  // namespace sim::cli
