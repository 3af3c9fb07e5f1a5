#include "core/engine/import_h5md.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>

#include "core/base/error.h"
#include "core/engine/temporary.h"
#include "core/output/process.h"
#include "core/output/read_file.h"

namespace sim::engine {
namespace {

// A file without a name, for what the other program writes: it finds it through us.
class Between {
 public:
  Between() {
    std::string name = temporary_folder() / "sim-import-XXXXXX";
    file_ = ::mkostemp(name.data(), O_CLOEXEC);
    if (file_ < 0)
      throw Error(ErrorKind::kIo, {"cannot write", name, std::strerror(errno),
                                   "TMPDIR says where files of a moment are"});
    ::unlink(name.c_str());
  }
  ~Between() { ::close(file_); }
  Between(const Between&) = delete;
  Between& operator=(const Between&) = delete;

  std::string path() const {
    return "/proc/" + std::to_string(::getpid()) + "/fd/" + std::to_string(file_);
  }
  // The next part of the text; empty at its end.
  std::string read() {
    std::string text(std::size_t{1} << 20, '\0');
    const ssize_t count = ::pread(file_, text.data(), text.size(), at_);
    text.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
    at_ += static_cast<off_t>(text.size());
    return text;
  }

 private:
  int file_ = -1;
  off_t at_ = 0;
};

}  // namespace

void import_h5md(const ImportTask& task) {
  check_input_file(task.file, HUGE_VAL, "check the name and its permissions");
  if (::access(task.read_h5md.c_str(), X_OK) != 0)
    throw Error(ErrorKind::kIo, {"cannot import", task.file, "this build has no HDF5",
                                 "install libhdf5-dev and build again"});
  Between between;
  Process process(
      {task.read_h5md.string(), std::filesystem::absolute(task.file).string(), between.path()});
  std::string why = process.finish();
  if (why == "it failed") why = "it is damaged: the HDF5 library failed over it";
  if (!why.empty())
    throw Error(ErrorKind::kUsage, {"bad H5MD file", task.file, why,
                                    "sim import reads H5MD 1, as --out run.h5 writes it"});
  std::string text = between.read();
  // The text begins with notes on data that a scene cannot express.
  for (std::size_t at = 0; text.compare(at, 3, "-- ") == 0;) {
    const std::size_t end = std::min(text.find('\n', at), text.size() - 1);
    task.tell(text.substr(at + 3, end - at - 3));
    at = end + 1;
  }
  for (; !text.empty(); text = between.read()) task.write(text);
}

}  // namespace sim::engine
