#include "tests/fuzz/fuzz.h"

#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <new>

#include "core/base/error.h"

namespace sim_fuzz {

const sim::cli::Environment& environment() {
  static const sim::cli::Environment found = sim::cli::find_environment({});
  return found;
}

sim::Registry& registry() {
  static sim::Registry opened = sim::cli::open_registry(environment(), {});
  return opened;
}

namespace {

// A folder of its own for the files that a session writes.
struct Folder {
  Folder() {
    char name[] = "/tmp/sim_fuzz_XXXXXX";
    if (!::mkdtemp(name)) std::abort();
    path = name;
    std::filesystem::current_path(path);
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
  std::filesystem::path path;
};

}  // namespace
}  // namespace sim_fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  sim_fuzz::environment();  // while this is the folder of the build
  static const sim_fuzz::Folder folder;
  try {
    sim_fuzz::fuzz({reinterpret_cast<const char*>(data), size});
  } catch (const sim::Error& error) {
    // One that blames the program itself is a finding.
    if (error.kind() == sim::ErrorKind::kInternal) std::abort();
  } catch (const std::bad_alloc&) {}
  return 0;
}
