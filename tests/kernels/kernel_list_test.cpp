// Every file of kernels is named by a test that compares it with a plain loop.
#include <catch2/catch.hpp>

#include <filesystem>
#include <fstream>
#include <sstream>

namespace fs = std::filesystem;

TEST_CASE("every file of kernels has a test that compares it with a plain loop") {
  const fs::path root = SIM_SOURCE_DIR;
  std::string tests;
  for (const auto& entry : fs::recursive_directory_iterator(root / "tests")) {
    if (!entry.path().filename().string().ends_with("_test.cpp")) continue;
    std::ostringstream text;
    text << std::ifstream(entry.path()).rdbuf();
    tests += text.str();
  }
  int kernels = 0;
  for (const char* const folder : {"core", "plugins"})
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
      const std::string name = entry.path().filename().string();
      if (!name.ends_with("_kernel.cpp")) continue;
      ++kernels;
      INFO(entry.path().string() << " needs a case with the tag of its name: see tests/kernels/");
      CHECK(tests.find("[" + entry.path().stem().string() + "]") != std::string::npos);
    }
  CHECK(kernels >= 20);
}
