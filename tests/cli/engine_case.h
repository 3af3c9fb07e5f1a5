// Scenes on engines: a net that they all take, runs in a folder, and how far two tables are apart.
#pragma once

#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "tests/cli/program.h"
#include "tests/support/skip.h"
#include "tests/support/temporary.h"

namespace sim_test {

// 60 particles anywhere, moving, tied at random by springs that all differ, under oblique gravity.
inline constexpr const char* kNet = R"lua(
local sim = require "sim"
local masses, drag = sim.arg("masses", "three", ""), sim.arg("drag", 0.01, "kg/s")
local n, ties = sim.arg("n", 60, ""), sim.arg("ties", 200, "")
local seed = 12345
local function any()
  seed = (seed * 16807) % 2147483647
  return seed / 2147483647
end
local p = sim.particles { mass = 0.01 }
for i = 0, n - 1 do
  local m = masses == "three" and 0.01 * (1 + i % 3) or 0.01 * (1 + any())
  p:add({ any(), any(), any() }, { mass = m, velocity = { any() - 0.5, any() - 0.5, any() } })
end
for i = 1, sim.arg("pins", 3, "") do p:pin(((i - 1) * 7) % n) end
local springs = sim.force.spring { stiffness = 5 }
for _ = 1, ties do
  local a, b = math.floor(any() * n), math.floor(any() * n)
  if a ~= b then springs:tie(a, b, { stiffness = 1 + 4 * any(), rest = 0.1 + 0.5 * any() }) end
end
local g = sim.arg("g", 9.81, "m/s^2")
local forces = { sim.force.gravity { g = { 0.3 * g, -g, 0.2 * g } } }
if drag > 0 then forces[#forces + 1] = sim.force.drag { k = drag } end
if ties > 0 then forces[#forces + 1] = springs end
return sim.scene { name = "net", particles = p, forces = forces, integrator = "verlet", dt = 0.002,
  duration = 0.4 }
)lua";

using Words = std::vector<std::string>;

inline Words with(Words words, const Words& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

struct Apart {
  double x = 0, v = 0;  // m, m/s
};

// The differences of two tables of states with the same head, steps, times and particles.
inline Apart apart(const std::filesystem::path& a, const std::filesystem::path& b) {
  const auto mine = lines_of(read_text(a)), theirs = lines_of(read_text(b));
  REQUIRE(mine.size() == theirs.size());
  REQUIRE(mine.size() > 1);
  CHECK(mine[0] == theirs[0]);
  Apart most;
  for (std::size_t i = 1; i < mine.size(); ++i) {
    const auto left = cells_of(mine[i]), right = cells_of(theirs[i]);
    for (std::size_t k = 0; k < 3; ++k) REQUIRE(left[k] == right[k]);
    for (std::size_t k = 3; k < 9; ++k) {
      double& worst = k < 6 ? most.x : most.v;
      const double difference = std::fabs(std::stod(left[k]) - std::stod(right[k]));
      worst = difference <= worst ? worst : difference;
    }
  }
  return most;
}

struct Here {
  TemporaryFolder folder;
  ProgramOptions options;

  Here() {
    options.folder = folder.path();
    options.environment = {{"OMPI_ALLOW_RUN_AS_ROOT", "1"},
                           {"OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"}};
    write_text(folder.path() / "net.lua", kNet);
  }
  std::filesystem::path operator()(const std::string& name) const { return folder.path() / name; }
  Outcome sim(const Words& words) const { return run_sim(words, options); }
};

inline void need_petsc() {
  if (!std::filesystem::exists(std::filesystem::path(SIM_BINARY).parent_path() / "sim-petsc"))
    skip("a build with PETSc", "libpetsc-real-dev openmpi-bin");
}

}  // namespace sim_test
