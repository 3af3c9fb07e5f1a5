// sim rest and --from-rest.
#include <catch2/catch.hpp>

#include "tests/cli/json_check.h"
#include "tests/cli/program.h"

namespace sim_test {
namespace {

TEST_CASE("sim rest says what force is left, as words, as JSON and as a table") {
  const Outcome words = run_sim({"rest", "scenes/cloth.lua"});
  CHECK(words.code == 0);
  CHECK_THAT(words.out, Catch::StartsWith("at rest: the largest force left is ") &&
                            Catch::Contains("potential energy -4.554761629 J"));
  const Outcome json = run_sim({"rest", "scenes/cloth.lua", "--json"});
  CHECK(json.code == 0);
  CHECK_THAT(json.out, Catch::Contains("\"potential\":-4.55476162931"));
  const Outcome table = run_sim({"rest", "scenes/pendulum.lua", "--dump"});
  CHECK(table.code == 0);
  CHECK(table.out.rfind("step,t,particle,x,y,z,vx,vy,vz", 0) == 0);
  CHECK_THAT(table.err, Catch::Contains("at rest"));
}

TEST_CASE("a run from rest stays there") {
  const Outcome run = run_sim({"scenes/cloth.lua", "--from-rest", "-n", "50"});
  CHECK(run.code == 0);
  CHECK_THAT(run.err, Catch::Contains("at rest") && Catch::Contains("trusted"));
  CHECK_THAT(run.out, Catch::Contains("-4.5548"));
}

TEST_CASE("what has no rest is said") {
  CHECK(run_sim({"rest", "scenes/circle.lua"}).code == 2);
  CHECK(run_sim({"rest", "scenes/cloth.lua", "--steps", "3"}).code == 2);
}

}  // namespace
}  // namespace sim_test
