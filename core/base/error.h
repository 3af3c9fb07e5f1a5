// The one error type of the kernel: what went wrong, where, why, and what to do about it.
#pragma once

#include <stdexcept>
#include <string>

namespace sim {

// The value is the exit code of the command line.
enum class ErrorKind {
  kInternal = 1,
  kUsage = 2,
  kScene = 3,
  kDiverged = 4,
  kIo = 5,
  kCheckpoint = 6,
  kPlugin = 7,
  kCheck = 8,
};

// Text of an error. `where` is FILE:LINE for scenes, an option or a file name elsewhere; it and
// `remedy` may be empty.
struct ErrorText {
  std::string what, where, why, remedy;
};

// Thrown while building (loading, checking, compiling a scene), never by a step of the kernel.
// what() is one line: "WHAT: WHERE: WHY; REMEDY".
class Error : public std::runtime_error {
 public:
  Error(ErrorKind kind, ErrorText text);

  ErrorKind kind() const noexcept { return kind_; }
  const ErrorText& text() const noexcept { return text_; }

 private:
  ErrorKind kind_;
  ErrorText text_;
};

}  // namespace sim
