#include "cli/terminal/console.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstring>
#include <exception>
#include <iostream>
#include <new>
#include <sstream>
#include <string>
#include <system_error>
#include <utility>

#include "core/base/utf8.h"

namespace sim::cli {
namespace {

bool same_place(int a, int b) {
  struct stat one {
  }, other{};
  return ::fstat(a, &one) == 0 && ::fstat(b, &other) == 0 && one.st_dev == other.st_dev &&
         one.st_ino == other.st_ino;
}

constexpr std::string_view kNoMemory =
    "sim: error: out of memory: the system has no more for this; make the scene smaller, or write "
    "fewer frames\n";

// The state of the C++ library's handlers, which take no argument.
std::atomic<bool> memory_is_gone;
std::atomic<char*> reserve;  // for the words and the files of the end
std::terminate_handler otherwise;

[[noreturn]] void no_memory() {
  memory_is_gone = true;
  delete[] reserve.exchange(nullptr);
  throw std::bad_alloc();
}

// Ends the process where no exception may pass, as in functions of libraries that do not throw:
// incomplete files of the run have no names yet.
[[noreturn]] void end_without_memory() {
  if (!memory_is_gone) otherwise();
  if (::write(STDERR_FILENO, kNoMemory.data(), kNoMemory.size()) < 0) {}
  ::_exit(static_cast<int>(ErrorKind::kIo));
}

}  // namespace

bool VisibleBuffer::put_raw(std::string_view text) {
  const auto size = static_cast<std::streamsize>(text.size());
  return inner_.sputn(text.data(), size) == size;
}

VisibleBuffer::int_type VisibleBuffer::overflow(int_type c) {
  if (traits_type::eq_int_type(c, traits_type::eof())) return traits_type::not_eof(c);
  const char one = traits_type::to_char_type(c);
  return xsputn(&one, 1) == 1 ? c : traits_type::eof();
}

// The last bytes of a block may begin a character that the next block ends.
std::streamsize VisibleBuffer::xsputn(const char* text, std::streamsize size) {
  const auto length = static_cast<std::size_t>(size);
  std::string joined;
  std::string_view block(text, length);
  if (!piece_.empty()) block = joined = std::exchange(piece_, {}).append(block);
  const std::size_t whole = block.size() - unfinished_utf8(block);
  piece_ = block.substr(whole);
  block = block.substr(0, whole);
  return (is_visible(block) ? put_raw(block) : put_raw(visible_text(block))) ? size : 0;
}

void put_control(std::ostream& stream, std::string_view sequence) {
  if (auto* const visible = dynamic_cast<VisibleBuffer*>(stream.rdbuf()))
    visible->put_raw(sequence);
  else
    stream << sequence;
}

Console standard_console() {
  constexpr std::size_t kReserve = 1 << 18;
  reserve = new (std::nothrow) char[kReserve];
  std::set_new_handler(no_memory);
  otherwise = std::set_terminate(end_without_memory);
  int descriptor = 0;
  do {
    descriptor = ::open("/dev/null", O_RDONLY);
  } while (descriptor >= 0 && descriptor <= STDERR_FILENO);
  if (descriptor >= 0) ::close(descriptor);
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);  // like a full disk
  std::ios::sync_with_stdio(false);
  std::cin.tie(nullptr);
  // They last as long as the process, as the streams do, and take no memory that may be refused.
  alignas(VisibleBuffer) static std::byte room[2][sizeof(VisibleBuffer)];
  std::cout.rdbuf(new (room[0]) VisibleBuffer(*std::cout.rdbuf()));
  std::cerr.rdbuf(new (room[1]) VisibleBuffer(*std::cerr.rdbuf()));
  return {std::cout, std::cerr, ::isatty(STDERR_FILENO) == 1,
          same_place(STDOUT_FILENO, STDERR_FILENO)};
}

void print_error(std::ostream& err, std::string_view message) {
  err << "sim: error: " << visible_line(message) << '\n' << std::flush;
}

// Ends without destructors or buffers, for other threads cannot be waited for.
void end_overrun(const ErrorText& why) {
  std::ostringstream line;
  print_error(line, Error(ErrorKind::kScene, why).what());
  const std::string text = line.str();
  if (::write(STDERR_FILENO, text.data(), text.size()) < 0) {}
  ::_exit(static_cast<int>(ErrorKind::kScene));
}

int report_exception(std::ostream& err) {
  try {
    throw;
  } catch (const ClosedPipe&) {
    return kClosedPipe;
  } catch (const Error& error) {
    print_error(err, error.what());
    return static_cast<int>(error.kind());
  } catch (const std::bad_alloc&) {
    err << kNoMemory << std::flush;
    return static_cast<int>(ErrorKind::kIo);
  } catch (const std::system_error& error) {  // a thread, mostly
    print_error(err, Error(ErrorKind::kIo, {"the system refused", "", error.what(),
                                            "give it more memory, or use fewer threads"})
                         .what());
    return static_cast<int>(ErrorKind::kIo);
  } catch (const std::exception& error) {
    print_error(err, std::string("internal: ") + error.what() + "; please report this");
  } catch (...) {
    print_error(err, "internal: unknown exception; please report this");
  }
  return static_cast<int>(ErrorKind::kInternal);
}

}  // namespace sim::cli
