// --debug-particle and sim adjacency: the springs of one particle, exactly.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/cli/json_check.h"
#include "tests/cli/program.h"

namespace sim_test {
namespace {

constexpr const char* kParticle12 =
    "scene cloth  64 particles  306 springs\n"
    "particle 12 (1,4)  11 springs\n"
    "structural  k 100 N/m  rest 0.125    m  4 11 13 20\n"
    "shear       k  50 N/m  rest 0.176777 m  3 5 19 21\n"
    "flex        k  25 N/m  rest 0.25     m  10 14 28\n";

TEST_CASE("the springs of particle 12 of the cloth, and no more") {
  const Outcome debug = run_sim({"--debug-particle", "12"});
  CHECK(debug.code == 0);
  CHECK(debug.out == kParticle12);
  CHECK(debug.err.empty());
  CHECK(run_sim({"adjacency", "scenes/cloth.lua", "12"}).out == kParticle12);
}

TEST_CASE("with a length of the run the springs come before and after it") {
  const Outcome outcome = run_sim({"--debug-particle", "12", "--steps", "3"});
  CHECK(outcome.code == 0);
  CHECK(outcome.out.rfind(kParticle12, 0) == 0);
  CHECK(outcome.out.rfind(kParticle12) > 200);
  CHECK(outcome.out.substr(outcome.out.rfind(kParticle12)) == kParticle12 + outcome.err);
  CHECK(outcome.out.find("     step") != std::string::npos);
  // At the end each spring's state, too: k = 100 N/m between free particles of 1/64 kg stands 25
  // ms.
  const auto lines = lines_of(outcome.out);
  const auto state = std::find_if(lines.begin(), lines.end(), [](const std::string& line) {
    return line.rfind("      4  structural", 0) == 0;
  });
  REQUIRE(state != lines.end());
  CHECK(state->find(" %") != std::string::npos);
  CHECK(state->ends_with("0.02516"));
}

TEST_CASE("the springs as JSON, with the tension of the present state") {
  const Outcome still = run_sim({"--debug-particle", "12", "--json"});
  const Json object = read_json(still.out);
  CHECK(object.keys == std::vector<std::string>{"particle", "springs"});
  CHECK(object.at("particle").number == 12);
  const auto& springs = object.at("springs").list;
  REQUIRE(springs.size() == 11);
  const std::vector<double> to{4, 11, 13, 20, 3, 5, 19, 21, 10, 14, 28};
  for (std::size_t i = 0; i < springs.size(); ++i) {
    CHECK(springs[i].keys ==
          std::vector<std::string>{"family", "to", "stiffness", "rest", "length", "force"});
    CHECK(springs[i].at("to").number == to[i]);
    CHECK(springs[i].at("family").text == (i < 4 ? "structural" : i < 8 ? "shear" : "flex"));
    CHECK(springs[i].at("force").number == Approx(0).margin(1e-12));
  }
  CHECK(springs[4].at("rest").number == std::sqrt(2.0) / 8);

  // Line 1: the start; line 2: the end, where the springs pull; line 3: the summary.
  const auto lines =
      lines_of(run_sim({"--debug-particle", "12", "--json", "--time", "0.5", "-q"}).out);
  REQUIRE(lines.size() == 3);
  CHECK(lines[0] + "\n" == still.out);
  const Json moved = read_json(lines[1]);
  double most = 0;
  for (const Json& spring : moved.at("springs").list) {
    const double force =
        spring.at("stiffness").number * (spring.at("length").number - spring.at("rest").number);
    CHECK(spring.at("force").number == force);
    most = std::max(most, std::abs(force));
  }
  CHECK(most > 0.01);
  CHECK(read_json(lines[2]).at("verdict").text == "trusted");
}

TEST_CASE("particles of a world are named, or each system answers") {
  const Outcome both = run_sim({"adjacency", "scenes/sample.lua", "2"});
  CHECK(both.out.find("scene cloth  64 particles  306 springs\nparticle 2 (0,2)  8 springs\n") ==
        0);
  CHECK(both.out.find("scene pendulum  4 particles  3 springs\nparticle 2  2 springs\n"
                      "link  k 200 N/m  rest 0.5 m  1 3\n") != std::string::npos);
  const Outcome one = run_sim({"adjacency", "scenes/sample.lua", "pendulum:3", "--json"});
  CHECK(read_json(one.out).at("system").text == "pendulum");
  CHECK(read_json(one.out).at("springs").list.size() == 1);
}

TEST_CASE("particles that are not there") {
  const auto fails = [](const std::vector<std::string>& words, const std::string& part) {
    const Outcome outcome = run_sim(words);
    INFO(outcome.err);
    CHECK(outcome.code == 2);
    CHECK(outcome.out.empty());
    CHECK(outcome.err.find(part) != std::string::npos);
  };
  fails({"--debug-particle", "64"}, "0 to 63");
  fails({"--debug-particle", "99999999999", "-n", "1"}, "0 to 63");
  fails({"adjacency", "scenes/circle.lua", "0"}, "first-order scene has no springs");
  fails({"adjacency", "scenes/sample.lua", "circle:0"}, "first-order");
  fails({"adjacency", "scenes/sample.lua", "clth:0"}, "cloth");
}

}  // namespace
}  // namespace sim_test
