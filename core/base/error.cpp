#include "core/base/error.h"

#include <utility>

namespace sim {
namespace {

std::string one_line(const ErrorText& text) {
  std::string line = text.what;
  if (!text.where.empty()) line += ": " + text.where;
  if (!text.why.empty()) line += ": " + text.why;
  if (!text.remedy.empty()) line += "; " + text.remedy;
  return line;
}

}  // namespace

Error::Error(ErrorKind kind, ErrorText text)
    : std::runtime_error(one_line(text)), kind_(kind), text_(std::move(text)) {}

}  // namespace sim
