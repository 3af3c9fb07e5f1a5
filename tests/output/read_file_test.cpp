// Whole files as text: what is not whole is an error.
#include "core/output/read_file.h"

#include <catch2/catch.hpp>
#include <fstream>

#include "tests/support/temporary.h"

using namespace sim;

namespace {

ErrorText failure_of(const std::filesystem::path& file, std::size_t limit = kLargestInput) {
  try {
    read_whole_file(file, {"cannot read a thing", "thing", "", ""}, limit);
  } catch (const Error& error) {
    CHECK(error.kind() == ErrorKind::kIo);
    CHECK(error.text().what == "cannot read a thing");
    CHECK_FALSE(error.text().remedy.empty());
    return error.text();
  }
  return {};
}

}  // namespace

TEST_CASE("a file is read whole, whatever its size", "[base][files]") {
  const sim_test::TemporaryFolder folder;
  const auto file = folder.path() / "a";
  for (const std::size_t size : {0u, 1u, 65535u, 65536u, 65537u, 200000u}) {
    std::string text(size, 'x');
    for (std::size_t i = 0; i < size; ++i) text[i] = static_cast<char>(i * i % 251);
    std::ofstream(file, std::ios::binary) << text;
    CHECK(read_whole_file(file, {"", "", "", ""}) == text);
    CHECK(read_whole_file(file, {"", "", "", ""}, size) == text);
    if (size > 0) CHECK(failure_of(file, size - 1).why.find("larger than") != std::string::npos);
  }
  // /proc says that its files are empty.
  CHECK(read_whole_file("/proc/self/stat", {"", "", "", ""}).size() > 20);
}

TEST_CASE("a file that cannot be read names why and what helps", "[base][files]") {
  const sim_test::TemporaryFolder folder;
  CHECK(failure_of(folder.path()).why == "it is a folder");
  CHECK(failure_of(folder.path() / "none").why == "No such file or directory");
  CHECK(failure_of("/proc/self/mem").why == "Input/output error");
  CHECK(failure_of("/dev/zero").why == "it is not a regular file");
  const std::filesystem::path large = folder.path() / "large";
  std::ofstream(large) << std::string((std::size_t{1} << 20) + 1, 'x');
  CHECK(failure_of(large, std::size_t{1} << 20).why == "it is larger than 2 MB");
}
