// Observables in tables and beside the refined run; and runs that end at the time asked for.
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/cli/json_check.h"
#include "tests/cli/program.h"
#include "tests/support/temporary.h"

namespace sim_test {
namespace {

// A chain of four beads; `observe` is a table of functions.
std::string chain(const std::string& observe, const std::string& more = "") {
  return "local sim = require 'sim'\n"
         "local beads = sim.particles { mass = 1 }\n"
         "for i = 0, 3 do beads:add { 0.5 * i, 0, 0 } end\n"
         "beads:pin(0)\n"
         "local links = sim.force.spring { family = 'link', stiffness = 200 }\n"
         "for i = 1, 3 do links:tie(i - 1, i) end\n"
         "return sim.scene { name = 'chain', particles = beads, integrator = 'verlet',\n"
         "  dt = 0.01, duration = 1,\n"
         "  forces = { sim.force.gravity { g = {0, -9.81, 0} }, links },\n" +
         more + "  observe = " + observe + " }\n";
}

const std::string kSagAndEnergy =
    "{ sag = function(s) return s:position(3)[2] end,\n"
    "    energy = function(s) local e, k, p = s:energy(); return e - k - p end,\n"
    "    speed = function(s) return s:velocity(3)[2] end,\n"
    "    time = function(s) return s:t() end }";

struct SceneFile {
  TemporaryFolder folder;
  std::string name = (folder.path() / "scene.lua").string();
  explicit SceneFile(const std::string& text) { write_text(name, text); }
};

TEST_CASE("what a scene observes is a table like the others") {
  const SceneFile scene(chain(kSagAndEnergy));
  const Outcome seen = run_sim({scene.name, "--observe", "--every", "50", "-q"});
  REQUIRE(seen.code == 0);
  const auto lines = lines_of(seen.out);
  REQUIRE(lines.size() == 4);
  CHECK(lines[0] == "step,t,energy,sag,speed,time");
  const Outcome dump = run_sim({scene.name, "--dump", "--every", "50", "-q"});
  for (std::size_t frame = 0; frame < 3; ++frame) {
    const auto cells = cells_of(lines[1 + frame]);
    const auto bead = cells_of(lines_of(dump.out)[1 + 4 * frame + 3]);
    REQUIRE(cells.size() == 6);
    CHECK(cells[0] == std::to_string(50 * frame));
    CHECK(cells[2] == "0");
    CHECK(cells[3] == bead[4]);
    CHECK(cells[4] == bead[7]);
    CHECK(cells[5] == cells[1]);
  }
  const std::string file = (scene.folder.path() / "seen.jsonl").string();
  CHECK(run_sim({scene.name, "--observe=" + file, "-n", "0", "-q"}).code == 0);
  CHECK(read_text(file) == "{\"step\":0,\"t\":0,\"energy\":0,\"sag\":0,\"speed\":0,\"time\":0}\n");
}

TEST_CASE("numbers that are not finite are empty fields, and each system has its own") {
  const SceneFile scene(
      "local sim = require 'sim'\n"
      "local function decay(observe) return sim.scene { state = {1}, integrator = 'rk4',\n"
      "  dt = 0.1, duration = 0.1, observe = observe,\n"
      "  field = sim.field.lua { function(t, x) return { -x[1] } end } } end\n"
      "return sim.world { a = decay { x = function(s) return s:component(0) end },\n"
      "  b = decay { y = function(s) return 0 / 0 end }, c = decay(nil) }\n");
  const Outcome seen = run_sim({scene.name, "--observe", "-n", "0", "-q"});
  CHECK(seen.out == "system,step,t,x,y\na,0,0,1,\nb,0,0,,\nc,0,0,,\n");
}

TEST_CASE("the report tells how far the shadow's quantities are") {
  const SceneFile scene(chain("{ sag = function(s) return s:position(3)[2] end }"));
  const auto sag = [&](const std::string& dt) {
    const Outcome seen = run_sim({scene.name, "-d", dt, "--observe", "--every", "1000000", "-q"});
    return std::stod(cells_of(lines_of(seen.out).back())[2]);
  };
  const Outcome run = run_sim({scene.name, "--json", "-q"});
  REQUIRE(!read_json(run.out).members.empty());
  const auto number = [&](const std::string& key) {
    return std::stod(run.out.substr(run.out.find("\"" + key + "\":") + key.size() + 3));
  };
  CHECK(number("value") == sag("0.01"));
  CHECK(number("difference") == Approx(std::abs(sag("0.01") - sag("0.005"))));
  CHECK(number("difference_most") >= number("difference"));
  const Outcome text = run_sim({scene.name, "--verify"});
  CHECK(text.out.find("observed    sag = ") != std::string::npos);
  CHECK(text.out.find("with half the step ") != std::string::npos);
  CHECK(run_sim({scene.name, "--no-verify"}).out.find("half the step") == std::string::npos);
}

TEST_CASE("mistakes in an observer name it and its line") {
  const auto error = [](const std::string& observe) {
    const SceneFile scene(chain(observe));
    const Outcome run = run_sim({scene.name, "-q"});
    CHECK(run.code == 3);
    CHECK(run.out.empty());
    return run.err;
  };
  const auto says = [](const std::string& text, const std::string& part) {
    INFO(text);
    CHECK(text.find(part) != std::string::npos);
  };
  for (const char* result : {"nil", "'far'", "true", "{}"}) {
    const std::string text = error("{ sag = function(s) return " + std::string(result) + " end }");
    says(text, "bad result of observer 'sag': ");
    says(text, "scene.lua:10: expected a number, got ");
  }
  says(error("{ sag = function(s) return s.x.y end }"), "scene.lua:10: a state has other methods");
  says(error("{ sag = function(s) error 'no' end }"), "error in observer 'sag': ");
  says(error("{ sag = function(s) return s:position(4)[1] end }"),
       "expected a whole number from 0 to 3, got 4");
  says(error("{ sag = function(s) return s:component(0) end }"), "this scene has none");
  says(error("{ sag = function(s) return s.position(0)[1] end }"), "write it with a colon");
  says(error("(function() local kept\n"
             "  return { a = function(s) kept = s return 1 end,\n"
             "    b = function(s) return kept:t() end } end)()"),
       "only while its function runs");
  says(error("{ function(s) return 1 end }"), "every quantity has a name");
  says(error("{ step = function(s) return 1 end }"), "tables have a column of that name");
  says(error("{ sag = 3 }"), "expected a function(s) written in the scene, got 3");
  says(error("7"), "expected { NAME = function(s) ... end }, got 7");
  CHECK(run_sim({"--observe"}).err.find("nothing to observe") != std::string::npos);
}

// The last row of a table of observed times.
std::vector<std::string> last_row(std::vector<std::string> words) {
  words.insert(words.end(), {"--dump", "--every", "1000000", "-q"});
  return cells_of(lines_of(run_sim(words).out).back());
}

TEST_CASE("a run ends at the time asked for, and its other steps keep their bits") {
  for (const char* method : {"verlet", "rk4", "dopri5", "bdf2", "implicit_midpoint"}) {
    INFO(method);
    const std::vector<std::string> words{"-i", method, "-d", "0.003", "-s", "n=3"};
    auto to_end = words, steps = words;
    to_end.insert(to_end.end(), {"-T", "0.01"});
    steps.insert(steps.end(), {"-n", "3"});
    CHECK(last_row(to_end)[1] == "0.01");
    const Outcome whole = run_sim([&] {
      auto all = to_end;
      all.insert(all.end(), {"--dump", "-q"});
      return all;
    }());
    const auto rows = lines_of(whole.out);
    REQUIRE(rows.size() == 1 + 5 * 9);
    CHECK(rows[4 * 9] == lines_of(run_sim([&] {
                                    auto all = steps;
                                    all.insert(all.end(), {"--dump", "-q"});
                                    return all;
                                  }())
                                      .out)[4 * 9]);
  }
  const Outcome report = run_sim({"-d", "0.003", "-T", "0.01"});
  CHECK(report.out.find("4 steps to t = 0.01 s, the last after 0.001 s") != std::string::npos);
  CHECK(run_sim({"-d", "0.005", "-T", "0.01"}).out.find("the last after") == std::string::npos);
  // A method that keeps earlier steps restarts for this, and says so.
  const auto told = [&](const std::string& time, const std::string& method) {
    return run_sim({"-i", method, "-d", "0.003", "-s", "n=3", "-T", time});
  };
  CHECK(told("0.01", "bdf2")
            .out.find("last step   0.001 s: bdf2 keeps earlier steps, and began "
                      "anew for it") != std::string::npos);
  CHECK(told("0.009", "bdf2").out.find("began anew") == std::string::npos);
  for (const char* method : {"trbdf2", "rk4", "dopri5"})
    CHECK(told("0.01", method).out.find("began anew") == std::string::npos);
}

TEST_CASE("a shortened last step is as exact as the others, also in the shadow") {
  const SceneFile scene(
      "local sim = require 'sim'\n"
      "return sim.scene { state = {1, 0}, integrator = 'rk4', dt = 0.03, duration = 1,\n"
      "  field = sim.field.lua { function(t, x) return { -x[2], x[1] } end },\n"
      "  exact = function(t) return { math.cos(t), math.sin(t) } end }\n");
  for (const char* method : {"rk4", "dop853", "bdf2"}) {
    const Outcome run = run_sim({scene.name, "-i", method, "--json", "-q"});
    INFO(method << run.out);
    const auto number = [&](const std::string& key) {
      return std::stod(run.out.substr(run.out.find("\"" + key + "\":") + key.size() + 3));
    };
    CHECK(number("t") == 1);
    const double most = method == std::string("bdf2") ? 2e-3 : 1e-6;
    CHECK(number("error") < most);
    CHECK(number("position_error") < 2 * most);
    CHECK(number("position_error") > 0.5 * number("error"));
  }
}

TEST_CASE("a run goes on from a shortened step") {
  const TemporaryFolder folder;
  const std::string file = (folder.path() / "part.sim").string();
  REQUIRE(run_sim({"-d", "0.003", "-T", "0.01", "--snap", file, "-q"}).code == 0);
  const Outcome rest = run_sim({"--resume", file, "-T", "0.02", "--dump", "-q"});
  REQUIRE(rest.code == 0);
  const auto rows = lines_of(rest.out);
  CHECK(cells_of(rows[1])[1] == "0.01");
  CHECK(cells_of(rows[1 + 64])[1] == "0.013000000000000001");
  CHECK(cells_of(rows.back())[1] == "0.02");
}

}  // namespace
}  // namespace sim_test
