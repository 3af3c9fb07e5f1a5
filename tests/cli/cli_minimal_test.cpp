// sim minimal: which parts of a scene does a result need?
#include <catch2/catch.hpp>
#include <cmath>
#include <sstream>

#include "core/base/text.h"
#include "tests/cli/json_check.h"
#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;

TEST_CASE("sim minimal takes a world apart, and its command runs") {
  const Outcome outcome = run_sim({"minimal", "scenes/sample.lua", "-T", "0.3", "--json"});
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
  const Json study = JsonReader(outcome.out).read();
  CHECK(study.at("system").text == "circle, cloth, pendulum");
  CHECK(study.at("budget").at("cloth").number > 0);
  const auto part = [&](const std::string& option) -> const Json& {
    for (const Json& each : study.at("parts").list)
      if (each.at("option").text == option) return each;
    throw std::runtime_error("no part " + option);
  };
  CHECK(part("--without pendulum.gravity").at("change").number > 0.05);
  CHECK_FALSE(part("--without pendulum.gravity").at("within").flag);
  CHECK(part("--without cloth.flex").at("change").number <
        part("--without cloth.structural").at("change").number);
  std::istringstream said(study.at("command").text);
  std::vector<std::string> words;
  for (std::string word; said >> word;) words.push_back(word);
  words.erase(words.begin());
  CHECK(run_sim(words).code == 0);
  const Outcome wrong = run_sim({"scenes/sample.lua", "--without", "pendulum.flex"});
  CHECK(wrong.code == 2);
  CHECK(wrong.err.find("did you mean") != std::string::npos);
}

TEST_CASE("sim minimal looks at runs without shortening their steps") {
  const TemporaryFolder folder;
  const std::string scene = (folder.path() / "decay.lua").string();
  write_text(
      scene,
      "local sim = require 'sim'\n"
      "return sim.scene { state = { 1 }, field = sim.field.formula { '-u', names = {'u'} },\n"
      "  integrator = 'euler', dt = 0.1, duration = 1 }\n");
  const Outcome outcome = run_sim({"minimal", scene, "--json"});
  REQUIRE(outcome.code == 0);
  const Json part = JsonReader(outcome.out).read().at("parts").list.front();
  CHECK(part.at("option").text == "-d 0.2");
  // Ten steps of 0.9 and five of 0.8.
  CHECK(part.at("change").number == Approx(std::pow(0.9, 10) - std::pow(0.8, 5)).epsilon(1e-9));
}

TEST_CASE("sim minimal drops what the result does not need, and its command runs") {
  const TemporaryFolder folder;
  const std::string scene = (folder.path() / "two.lua").string();
  write_text(scene,
             "local sim = require 'sim'\n"
             "local beads = sim.particles { mass = 1 }\n"
             "for i = 0, 2 do beads:add { 0.5 * i, 0, 0 } end\n"
             "beads:pin(0)\n"
             "local weak = sim.force.spring { family = 'weak', stiffness = 1e-6 }\n"
             "local link = sim.force.spring { family = 'link', stiffness = 200 }\n"
             "for i = 1, 2 do link:tie(i - 1, i) end weak:tie(0, 2)\n"
             "return sim.scene { particles = beads, integrator = 'rk4', dt = 0.005,\n"
             "  duration = 1, observe = { y = function(s) return s:position(2)[2] end },\n"
             "  forces = { sim.force.gravity { g = {0, -9.81, 0} }, link, weak } }\n");
  const std::string plugins = folder.path().string();  // printed again: the command may need it
  const Outcome outcome =
      run_sim({"minimal", scene, "--budget", "1%", "--json", "--plugin-path", plugins});
  REQUIRE(outcome.code == 0);
  const Json study = JsonReader(outcome.out).read();
  CHECK(study.at("command").text.find("--plugin-path " + plugins) != std::string::npos);
  const auto part = [&](const std::string& option) -> const Json& {
    for (const Json& each : study.at("parts").list)
      if (each.at("option").text == option) return each;
    throw std::runtime_error("no part " + option);
  };
  CHECK(part("--without weak").at("within").flag);
  CHECK(part("--without weak").at("change").number < 1e-4);
  CHECK_FALSE(part("--without link").at("within").flag);
  CHECK_FALSE(part("--without gravity").at("within").flag);
  CHECK(part("--without gravity").at("observed").at("y").number > 0.5);
  CHECK(part("-d 0.01").at("evaluations").number == 400);
  CHECK(study.at("smallest").at("change").number <= 0.01);
  CHECK(study.at("own_error").number < 1e-4);
  const std::string command = study.at("command").text;
  CHECK(command.find("--without weak") != std::string::npos);
  std::istringstream said(command);
  std::vector<std::string> words;
  for (std::string word; said >> word;) words.push_back(word);
  words.erase(words.begin());
  const Outcome run = run_sim(words);
  CHECK(run.code == 0);
  CHECK(run.out.find("weak") == std::string::npos);
  CHECK(run_sim({scene, "--without", "week"}).err.find("did you mean 'weak'?") !=
        std::string::npos);
}

TEST_CASE("sim minimal offers the method that comes next in cost, down to the simplest") {
  // Fewer evaluations a step, or as many with a lower order; a symplectic one first of equals.
  const std::pair<const char*, const char*> next[] = {{"pefrl", "yoshida4"},
                                                      {"rk3", "midpoint"},
                                                      {"trapezoid", "verlet"},
                                                      {"verlet", "symplectic_euler"},
                                                      {"euler", ""}};
  for (const auto& [method, simpler] : next) {
    INFO(method);
    const Outcome outcome = run_sim(
        {"minimal", "scenes/cloth.lua", "-i", method, "-T", "0.01", "-d", "0.001", "--json"});
    REQUIRE(outcome.code == 0);
    std::string offered;
    const Json study = JsonReader(outcome.out).read();
    for (const Json& part : study.at("parts").list)
      if (part.at("option").text.starts_with("-i ")) offered += part.at("option").text.substr(3);
    CHECK(offered == simpler);
  }
}
