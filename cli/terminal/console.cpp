#include "cli/terminal/console.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <iostream>
#include <new>
#include <sstream>
#include <string>

namespace sim::cli {
namespace {

bool same_place(int a, int b) {
  struct stat one {
  }, other{};
  return ::fstat(a, &one) == 0 && ::fstat(b, &other) == 0 && one.st_dev == other.st_dev &&
         one.st_ino == other.st_ino;
}

}  // namespace

Console standard_console() {
  int descriptor = 0;
  do {
    descriptor = ::open("/dev/null", O_RDONLY);
  } while (descriptor >= 0 && descriptor <= STDERR_FILENO);
  if (descriptor >= 0) ::close(descriptor);
  std::signal(SIGPIPE, SIG_IGN);
  std::ios::sync_with_stdio(false);
  std::cin.tie(nullptr);
  return {std::cout, std::cerr, ::isatty(STDERR_FILENO) == 1,
          same_place(STDOUT_FILENO, STDERR_FILENO)};
}

void print_error(std::ostream& err, std::string_view message) {
  constexpr std::string_view kHex = "0123456789abcdef";
  std::string line = "sim: error: ";
  for (const char c : message) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x20 && byte != 0x7f) {
      line += c;
    } else {
      line += "\\x";
      line += kHex[byte >> 4];
      line += kHex[byte & 15];
    }
  }
  err << line << '\n' << std::flush;
}

// What other threads do meanwhile cannot be waited for: neither destructors nor buffers.
void end_overrun(const ErrorText& why) {
  std::ostringstream line;
  print_error(line, Error(ErrorKind::kScene, why).what());
  const std::string text = line.str();
  if (::write(STDERR_FILENO, text.data(), text.size()) < 0) {}
  ::_exit(static_cast<int>(ErrorKind::kScene));
}

int report_exception(std::ostream& err) {
  constexpr int kClosedPipe = 141;  // 128 + SIGPIPE, as a shell reports it
  try {
    throw;
  } catch (const ClosedPipe&) {
    return kClosedPipe;
  } catch (const Error& error) {
    print_error(err, error.what());
    return static_cast<int>(error.kind());
  } catch (const std::bad_alloc&) {
    print_error(err,
                "out of memory: the machine has no more for this; make the scene smaller, or "
                "write fewer frames");
    return static_cast<int>(ErrorKind::kIo);
  } catch (const std::exception& error) {
    print_error(err, std::string("internal: ") + error.what() + "; please report this");
  } catch (...) {
    print_error(err, "internal: unknown exception; please report this");
  }
  return static_cast<int>(ErrorKind::kInternal);
}

}  // namespace sim::cli
