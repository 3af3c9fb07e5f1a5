// A folder with the scenes of strip.h, in which the program writes files.
#pragma once

#include <catch2/catch.hpp>

#include "tests/cli/program.h"
#include "tests/output/strip.h"
#include "tests/support/temporary.h"

namespace sim_test {

class WritingFolder {
 public:
  WritingFolder() {
    options_.folder = folder_.path();
    write_text(at("strip.lua"), kStrip);
    write_text(at("flow.lua"), kFlow);
    write_text(at("flat.lua"), kFlat);
    write_text(at("world.lua"), kWorld);
  }
  std::filesystem::path at(const std::string& name) const { return folder_.path() / name; }
  std::string text(const std::string& name) const { return read_text(at(name)); }
  Outcome run(const std::vector<std::string>& words,
              const std::string& program = SIM_BINARY) const {
    ProgramOptions options = options_;
    options.program = program;
    Outcome done = run_sim(words, options);
    INFO(done.err);
    REQUIRE(done.code == 0);
    return done;
  }

 private:
  TemporaryFolder folder_;
  ProgramOptions options_;
};

// Equal but for roundings of a few operations.
inline Approx near(double value) { return Approx(value).epsilon(1e-13).margin(1e-13); }

}  // namespace sim_test
