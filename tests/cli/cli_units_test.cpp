// Amounts with a unit on the command line, as the program reads them.
#include <catch2/catch.hpp>

#include "tests/cli/json_check.h"
#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;

TEST_CASE("an amount is read in its unit, a share of the size of the motion") {
  // A circle of 2 m: the size that a share is of.
  const TemporaryFolder folder;
  write_text(folder.path() / "c.lua",
             "local sim = require 'sim'\n"
             "return sim.scene { name = 'c', state = { x = {{2, 0, 0}} },\n"
             "  field = sim.field.rotation { omega = 1 }, integrator = 'rk4', dt = 0.01,\n"
             "  duration = 1 }\n");
  const auto run = [&](const std::string& amount) {
    return run_sim(
        {"tradeoff", "c.lua", "-T", "1", "--integrators", "rk4", "--budget", amount, "--json"},
        {.folder = folder.path()});
  };
  const auto metres = [&](const std::string& amount) {
    const Outcome outcome = run(amount);
    INFO(amount << ": " << outcome.err);
    REQUIRE(outcome.code == 0);
    return JsonReader(outcome.out).read().at("budget").number;
  };
  CHECK(metres("2 cm") == Approx(0.02).epsilon(1e-14));
  CHECK(metres("2cm") == Approx(0.02).epsilon(1e-14));
  CHECK(metres("30 um") == Approx(3e-5).epsilon(1e-14));
  CHECK(metres("4 mm") == Approx(0.004).epsilon(1e-14));
  CHECK(metres("0.5 m") == Approx(0.5).epsilon(1e-14));
  CHECK(metres("1%") == Approx(0.02).epsilon(1e-3));
  CHECK(metres("1e-2") == Approx(0.01).epsilon(1e-14));
  for (const char* amount : {"2 km", "2 m m", "% 2", "cm", "-1 mm", "0 m", "nan", "1e400 m"}) {
    INFO(amount);
    CHECK(run(amount).code == 2);
  }
}
