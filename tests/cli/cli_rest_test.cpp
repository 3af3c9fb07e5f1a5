// sim rest and --from-rest.
#include <catch2/catch.hpp>

#include "tests/cli/json_check.h"
#include "tests/cli/program.h"
#include "tests/lua/scene_text.h"

namespace sim_test {
namespace {

TEST_CASE("sim rest says what force is left, as words, as JSON and as a table") {
  const Outcome words = run_sim({"rest", "scenes/cloth.lua"});
  CHECK(words.code == 0);
  CHECK_THAT(words.out, Catch::StartsWith("at rest: the largest force left is ") &&
                            Catch::Contains("potential energy -4.554761629 J"));
  const Outcome json = run_sim({"rest", "scenes/cloth.lua", "--json"});
  CHECK(json.code == 0);
  const Json facts = read_json(json.out);
  CHECK(facts.keys == std::vector<std::string>{"system", "force", "in_play", "potential", "steps",
                                               "newton", "broke"});
  CHECK(facts.at("system").text == "cloth");
  CHECK(facts.at("potential").number == Approx(-4.55476162931).epsilon(1e-11));
  CHECK(facts.at("force").number < 1e-9 * facts.at("in_play").number);
  CHECK(facts.at("broke").number == 0);
  const Outcome table = run_sim({"rest", "scenes/pendulum.lua", "--dump"});
  CHECK(table.code == 0);
  CHECK(table.out.rfind("step,t,particle,x,y,z,vx,vy,vz", 0) == 0);
  CHECK_THAT(table.err, Catch::Contains("at rest"));
}

// Springs of their rest lengths leave forces of roundings; nothing else is in play.
TEST_CASE("a scene that nothing strains is at rest as it is") {
  const sim::test::SceneFolder folder;
  const auto triangle = [&](const std::string& pins) {
    return folder.write(
        "triangle.lua",
        "local sim = require 'sim'\nlocal p = sim.particles {}\np:add {0, 0, 0}\n"
        "p:add {0.1, 0, 0}\np:add {0.03, 0.1, 0}\n" +
            pins +
            "return sim.scene { particles = p, forces = { sim.force.spring { stiffness = 2000,"
            " ties = { {0, 1}, {0, 2}, {1, 2} } } }, integrator = 'verlet', dt = 1e-3,"
            " duration = 1 }\n");
  };
  for (const std::string pins : {"", "p:pin(0)\n", "p:pin(0, 1)\n"}) {
    INFO(pins);
    const Outcome rest = run_sim({"rest", triangle(pins)});
    INFO(rest.err);
    CHECK(rest.code == 0);
    CHECK_THAT(rest.out, Catch::StartsWith("at rest: ") && !Catch::Contains("depend on time"));
  }
}

TEST_CASE("rest under forces of time is said to be that of the present") {
  const sim::test::SceneFolder folder;
  const std::string kick = folder.write(
      "kick.lua",
      "local sim = require 'sim'\nlocal p = sim.particles { mass = 1 }\np:pin(p:add {0, 0, 0})\n"
      "p:add {1, 0, 0}\nreturn sim.scene { particles = p, forces = {\n"
      "sim.force.spring { stiffness = 100, ties = { {0, 1} } }, sim.force.gravity {},\n"
      "sim.force.expression { fx = 'if(t>1, 20, 0)' } }, integrator = 'rk4', dt = 0.01,\n"
      "duration = 6 }\n");
  CHECK_THAT(run_sim({"rest", kick}).out,
             Catch::Contains("; forces depend on time: this is for t = 0 s"));
  CHECK_THAT(run_sim({"rest", "scenes/cloth.lua"}).out, !Catch::Contains("depend on time"));
}

TEST_CASE("a run from rest stays there") {
  const Outcome run = run_sim({"scenes/cloth.lua", "--from-rest", "-n", "50"});
  CHECK(run.code == 0);
  CHECK_THAT(run.err, Catch::Contains("at rest") && Catch::Contains("trusted"));
  CHECK_THAT(run.out, Catch::Contains("-4.5548"));
}

TEST_CASE("a long search for rest says that it goes on, and ends when told to") {
  const Outcome search =
      run_sim({"rest", "scenes/dam.lua"}, {.signal = SIGINT, .signal_at = "no rest yet after 2 s"});
  CHECK(search.code != 0);
  CHECK_THAT(search.err, Catch::Contains("Ctrl-C ends it") && Catch::Contains("no rest was found"));
}

TEST_CASE("what has no rest is said, and why") {
  const sim::test::SceneFolder folder;
  const std::string falls = folder.write(
      "falls.lua",
      "local sim = require 'sim'\nlocal p = sim.particles { mass = 1 }\np:add {0, 0, 0}\n"
      "p:add {1, 0, 0}\nreturn sim.scene { particles = p, forces = { sim.force.gravity {}, "
      "sim.force.spring { stiffness = 10, ties = { {0, 1} } } }, integrator = 'rk4', dt = 0.01, "
      "duration = 1 }\n");
  const Outcome falling = run_sim({"rest", falls});
  CHECK(falling.code == 4);
  CHECK_THAT(falling.err, Catch::Contains("moves away without end") && Catch::Contains("pin"));
  // Its left end is held.
  const Outcome beam = run_sim({"rest", "scenes/beam.lua"});
  CHECK(beam.code == 0);
  CHECK_THAT(beam.out, Catch::Contains("at rest"));
  CHECK(run_sim({"rest", "scenes/circle.lua"}).code == 2);
  CHECK(run_sim({"rest", "scenes/cloth.lua", "--steps", "3"}).code == 2);
}

}  // namespace
}  // namespace sim_test
