#include "core/output/stream.h"

#include <cerrno>
#include <cstring>
#include <string>

#include "core/base/error.h"

namespace sim {

void put(std::ostream& stream, std::string_view text) {
  if (!stream.good()) return;
  errno = 0;
  stream.write(text.data(), static_cast<std::streamsize>(text.size()));
  stream.flush();
}

void flush_or_throw(std::ostream& stream, std::string_view name) {
  put(stream, "");
  if (stream.good()) return;
  if (errno == EPIPE) throw ClosedPipe();
  throw Error(ErrorKind::kIo, {"cannot write", std::string(name),
                               errno ? std::strerror(errno) : "the stream failed",
                               "check the space and the permissions there"});
}

}  // namespace sim
