// The studies as a user runs them: sim stability, sim order.
#include <algorithm>
#include <catch2/catch.hpp>
#include <csignal>
#include <set>
#include <utility>

#include "core/base/text.h"
#include "tests/cli/json_check.h"
#include "tests/cli/program.h"
#include "tests/support/temporary.h"

namespace sim_test {
namespace {

TEST_CASE("sim stability tells the largest steps of the cloth") {
  const Outcome outcome = run_sim({"stability", "scenes/cloth.lua", "--json"});
  REQUIRE(outcome.code == 0);
  const Json study = JsonReader(outcome.out).read();
  CHECK(study.at("omega_max").number == Approx(192.678).epsilon(1e-3));
  CHECK(study.at("damping").number == Approx(2));
  for (const char* name : {"euler", "trapezoid", "rk4", "verlet"}) {
    const Json& each = named(study.at("integrators"), name);
    CHECK(each.at("measured_dt").number == Approx(each.at("predicted_dt").number).epsilon(0.02));
  }
  CHECK(named(study.at("integrators"), "rk4").at("predicted_dt").number ==
        Approx(1.474e-2).epsilon(0.01));
  CHECK(named(study.at("integrators"), "rk4").at("energy").list.size() == 4);
}

TEST_CASE("sim stability says 0 where no step is stable") {
  const Outcome outcome =
      run_sim({"stability", "scenes/pendulum1.lua", "--integrators", "euler,trapezoid", "--json"});
  REQUIRE(outcome.code == 0);
  const Json study = JsonReader(outcome.out).read();
  CHECK(study.at("integrators").list.size() == 2);
  for (const Json& each : study.at("integrators").list) {
    CHECK(each.at("predicted_dt").number == 0);
    CHECK(each.at("predicted_dt").kind == Json::Kind::kNumber);
    CHECK(each.at("measured_dt").number == 0);
    CHECK(each.at("limit").text == "none stable");
  }
  const Outcome words = run_sim({"stability", "scenes/pendulum1.lua", "--integrators", "euler"});
  CHECK(words.out.find("euler has no stable step here") != std::string::npos);
}

TEST_CASE("sim stability --extremes maps every cell, and none is silently wrong") {
  const Outcome outcome =
      run_sim({"stability", "--extremes", "--integrators", "rk4,euler", "--json"});
  REQUIRE(outcome.code == 0);
  const Json all = JsonReader(outcome.out).read();
  for (const Json& each : all.at("integrators").list) {
    CHECK(each.at("silently_wrong").number == 0);
    CHECK(each.at("cells").list.size() == 7 * 7 * 6 + 5 * 6);
  }
  const Outcome words = run_sim({"stability", "--extremes", "--integrators", "rk4"});
  CHECK(words.out.find("rk4: ") != std::string::npos);
  CHECK(words.out.find(" 0 silently wrong") != std::string::npos);
  CHECK(run_sim({"stability", "scenes/cloth.lua", "--extremes"}).code == 2);
}

TEST_CASE("a world is studied system by system") {
  const Outcome outcome =
      run_sim({"stability", "scenes/sample.lua", "--integrators", "rk4", "--json"});
  REQUIRE(outcome.code == 0);
  const Json systems = JsonReader(outcome.out).read().at("systems");
  REQUIRE(systems.list.size() == 3);
  CHECK(systems.list[0].at("system").text == "circle");
  const std::vector<std::vector<std::string>> studies = {
      {"stability", "scenes/sample.lua", "--integrators", "rk4"},
      {"order", "rk4", "scenes/sample.lua"},
      {"tradeoff", "scenes/sample.lua", "--integrators", "rk4", "-T", "0.05"}};
  for (const std::vector<std::string>& study : studies) {
    const Outcome words = run_sim(study);
    INFO(study[0] << "\n" << words.out << words.err);
    CHECK(words.code == 0);
    for (const char* system : {"circle", "pendulum", "cloth"})
      CHECK(words.out.find(system) != std::string::npos);
  }
}

TEST_CASE("sim order names the order that a method has") {
  const Outcome outcome = run_sim({"order", "rk4", "scenes/circle.lua", "--json"});
  REQUIRE(outcome.code == 0);
  const Json study = JsonReader(outcome.out).read();
  CHECK(study.at("reference").at("how").text == "exact solution against extrapolation");
  const Json& rk4 = study.at("integrators").list.front();
  CHECK(rk4.at("observed").number == Approx(4).margin(0.1));
  CHECK(rk4.at("points").list.size() > 4);

  const Outcome words = run_sim({"order", "--integrators=verlet,rk4", "scenes/pendulum1.lua"});
  CHECK(words.code == 0);
  CHECK(words.out.find("local order") == std::string::npos);
  CHECK(run_sim({"order", "verlet", "scenes/pendulum1.lua"}).out.find("local order") !=
        std::string::npos);
}

TEST_CASE("studies take integrators with parameters") {
  const Outcome outcome =
      run_sim({"order", "dopri5:fixed_step=true", "scenes/pendulum1.lua", "--json"});
  REQUIRE(outcome.code == 0);
  const Json order = JsonReader(outcome.out).read();
  const Json& dopri5 = named(order.at("integrators"), "dopri5:fixed_step=true");
  CHECK(dopri5.at("observed").number == Approx(5).margin(0.3));
  for (const Json& point : dopri5.at("points").list)  // of a tolerance there is nothing
    CHECK(std::ranges::count(point.keys, "tol") == 0);

  // A single word is an integrator or a scene.
  CHECK(run_sim({"order", "rk4:precision=single", "-T", "0.05"}).out.find("rk4:precision=single") !=
        std::string::npos);

  const Outcome table =
      run_sim({"stability", "--integrators",
               "rk4:precision=single,dopri5:fixed_step=true,dopri5,rk4", "--json"});
  REQUIRE(table.code == 0);
  const Json stability = JsonReader(table.out).read();
  const Json& methods = stability.at("integrators");
  REQUIRE(methods.list.size() == 4);
  const Json& fixed = named(methods, "dopri5:fixed_step=true");
  CHECK(fixed.at("predicted_dt").number == Approx(8.845e-3).epsilon(0.01));
  CHECK(fixed.at("measured_dt").number == Approx(8.845e-3).epsilon(0.01));
  const Json &rk4 = named(methods, "rk4"), &single = named(methods, "rk4:precision=single");
  CHECK(single.at("predicted_dt").number == rk4.at("predicted_dt").number);
  const auto error = [](const Json& each) {  // of the shortest step, where 24 bits show
    return each.at("energy").list.front().at("error").number;
  };
  CHECK(error(single) > 1.2 * error(rk4));
}

TEST_CASE("the integrator of a scene is studied as the scene has it") {
  const TemporaryFolder folder;
  const std::string scene = read_text(SIM_SOURCE_DIR "/scripts/scenes/cloth.lua");
  const std::string chosen = "integrator = \"rk4\"";
  const auto at = scene.find(chosen);
  REQUIRE(at != std::string::npos);
  write_text(folder.path() / "single.lua",
             scene.substr(0, at) + "integrator = sim.integrator.rk4 { precision = \"single\" }" +
                 scene.substr(at + chosen.size()));
  const Outcome all = run_sim({"stability", "single.lua"}, {.folder = folder.path()});
  REQUIRE(all.code == 0);
  CHECK(all.out.find("\nrk4:precision=single ") != std::string::npos);
  CHECK(all.out.find("\nrk4 ") == std::string::npos);
  CHECK(all.out.find("\neuler ") != std::string::npos);
  CHECK(all.out.find(" rk4:precision=single, dt 0.005 s") != std::string::npos);

  // A name on the command line is what it is to -i.
  const Outcome two =
      run_sim({"stability", "single.lua", "--integrators", "rk4,rk4:precision=single"},
              {.folder = folder.path()});
  REQUIRE(two.code == 0);
  CHECK(two.out.find("\nrk4 ") != std::string::npos);
  CHECK(two.out.find("\nrk4:precision=single ") != std::string::npos);
}

TEST_CASE("sim tradeoff recommends, and writes every point and a plot") {
  const TemporaryFolder folder;
  const std::vector<std::string> words = {
      "tradeoff",      "scenes/pendulum1.lua", "-T",       "1",
      "--integrators", "rk4,verlet,euler",     "--budget", "1e-3 m"};
  std::vector<std::string> with = words;
  for (const char* word : {"--csv", "p.csv", "--svg", "p.svg", "--json"}) with.emplace_back(word);
  const Outcome outcome = run_sim(with, {.folder = folder.path()});
  REQUIRE(outcome.code == 0);
  const Json study = JsonReader(outcome.out).read();
  CHECK(study.at("budget").number == 1e-3);
  const Json& choice = study.at("recommended");
  CHECK(choice.at("error").number <= 1e-3);
  std::size_t points = 0;
  for (const Json& each : study.at("integrators").list) points += each.at("points").list.size();

  const std::string csv = read_text(folder.path() / "p.csv");
  CHECK(csv.rfind("system,integrator,order,dt,tol,status,error,", 0) == 0);
  CHECK(static_cast<std::size_t>(std::count(csv.begin(), csv.end(), '\n')) == points + 1);
  CHECK(csv.find(",,") == std::string::npos);
  CHECK(csv.find("nan") == std::string::npos);
  const std::string svg = read_text(folder.path() / "p.svg");
  CHECK(svg.rfind("<svg ", 0) == 0);
  CHECK(svg.ends_with("</svg>\n"));
  for (const char* name : {">rk4<", ">verlet<", ">euler<", ">budget 0.001 m<"})
    CHECK(svg.find(name) != std::string::npos);
  CHECK(svg.find("nan") == std::string::npos);
  CHECK(svg.find("inf") == std::string::npos);

  // The recommended command can be run as it stands.
  const Outcome text = run_sim(words);
  const std::string command = choice.at("command").text;
  REQUIRE(text.out.find("recommended for 0.001 m: off by ") != std::string::npos);
  CHECK(command.starts_with("sim scenes/pendulum1.lua -i "));
  std::istringstream said(command);
  std::vector<std::string> run;
  for (std::string word; said >> word;) run.push_back(word);
  run.erase(run.begin());
  const Outcome ran = run_sim(run);
  CHECK(ran.code == 0);
  CHECK(ran.out.find(" to t = 1 s\n") != std::string::npos);  // no shorter last step
}

// A verdict doubts positions that are off by 2 % of the size, whatever the budget.
TEST_CASE("sim tradeoff runs what it recommends, and refuses what its verdict doubts") {
  const std::vector<std::string> words = {
      "tradeoff",      "scenes/pendulum1.lua", "-T",       "4",
      "--integrators", "rk4,verlet",           "--budget", "20%"};
  std::vector<std::string> machine = words;
  machine.emplace_back("--json");
  const Json study = JsonReader(run_sim(machine).out).read();
  CHECK(study.at("recommended").at("verdict").text == "trusted");
  CHECK(study.at("recommended").at("reason").text.rfind("positions to ", 0) == 0);
  const auto& refused = study.at("refused").list;
  REQUIRE(!refused.empty());
  for (const Json& each : refused) {
    CHECK(each.at("verdict").text == "suspect");
    CHECK(each.at("error").number <= study.at("budget").number);
  }
  const std::string text = run_sim(words).out;
  CHECK_THAT(text, Catch::Contains("not recommended, though "));
  CHECK_THAT(text, Catch::Contains("\nthat run is trusted: positions to "));
}

TEST_CASE("sim tradeoff calls no method unstable that it did not try") {
  const Outcome outcome = run_sim({"tradeoff", "scenes/cloth.lua", "-s", "n=64", "-T", "0.005",
                                   "--integrators", "implicit_euler,verlet", "--budget", "1%"});
  REQUIRE(outcome.code == 0);
  CHECK_THAT(outcome.out, Catch::Contains("  implicit_euler: not tried: 20 steps take too long\n"));
  CHECK_THAT(outcome.out, !Catch::Contains("unstable"));
}

TEST_CASE("sim tradeoff compares the precisions of one method") {
  const Outcome outcome = run_sim({"tradeoff", "scenes/cloth.lua", "-T", "0.05", "--integrators",
                                   "pefrl,pefrl:precision=single", "--json"});
  REQUIRE(outcome.code == 0);
  const Json study = JsonReader(outcome.out).read();
  const auto least_error = [&](const std::string& name) {
    double least = 1;
    for (const Json& point : named(study.at("integrators"), name).at("points").list)
      if (point.at("status").text == "finite") least = std::min(least, point.at("error").number);
    return least;
  };
  CHECK(least_error("pefrl") < 1e-9);
  const double single = least_error("pefrl:precision=single");
  CHECK(single > 1e-8);
  CHECK(single < 1e-5);
}

TEST_CASE("sim tradeoff judges a quantity that the scene observes") {
  const Outcome outcome = run_sim({"tradeoff", "scenes/pendulum.lua", "-T", "1", "--of", "sag",
                                   "--budget", "1 mm", "--integrators", "verlet,rk4", "--json"});
  REQUIRE(outcome.code == 0);
  const Json study = JsonReader(outcome.out).read();
  CHECK(study.at("of").text == "sag");
  CHECK(study.at("budget").number == Approx(1e-3));
  CHECK(study.at("size").number > 1.5);  // it falls from 0 to about -2 m
  CHECK(study.at("size").number < 3);
  // By a run of its own, at every step.
  const Json& choice = study.at("recommended");
  const auto sags = [](const std::string& method, double dt) {
    const Outcome run = run_sim({"scenes/pendulum.lua", "-T", "1", "-i", method, "-d",
                                 sim::shortest(dt), "--observe", "-q"});
    std::vector<double> values;
    for (const std::string& line : lines_of(run.out))
      if (line[0] != 's') values.push_back(std::stod(cells_of(line)[2]));
    return values;
  };
  const double dt = choice.at("dt").number;
  const auto own = sags(choice.at("integrator").text, dt), fine = sags("rk4", dt / 16);
  double most = 0;
  for (std::size_t i = 0; i < own.size(); ++i)
    most = std::max(most, std::abs(own[i] - fine[16 * i]));
  CHECK(most == Approx(choice.at("error").number).epsilon(0.01));
}

TEST_CASE("the words of sim order stand in either order") {
  const std::vector<std::string> more{"-T", "0.1", "--json"};
  std::vector<std::string> one{"order", "rk4", "scenes/circle.lua"},
      other{"order", "scenes/circle.lua", "rk4"};
  for (auto* words : {&one, &other}) words->insert(words->end(), more.begin(), more.end());
  CHECK(run_sim(one).out == run_sim(other).out);
}

TEST_CASE("help of the studies names all they take, and the keys of --json") {
  for (const char* verb : {"tradeoff", "order", "minimal", "stability"}) {
    const std::string help = run_sim({verb, "--help"}).out;
    INFO(help);
    CHECK(help.find("(0x") == std::string::npos);
    CHECK(help.find("Keys of --json") != std::string::npos);
    CHECK((help.find("--time") != std::string::npos) == (std::string(verb) != "stability"));
    for (const std::string& line : lines_of(help)) CHECK(line.size() <= 80);
  }
}

TEST_CASE("tables of the studies fit 80 columns") {
  const std::string longest = "rk4:precision=single,dopri5:fixed_step=true";
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"stability"},
        {"stability", "-s", "structural=1e12"},
        {"stability", "--integrators", longest},
        {"order", "scenes/pendulum1.lua"},
        {"tradeoff", "scenes/pendulum1.lua", "-T", "1"},
        {"tradeoff", "scenes/pendulum1.lua", "-T", "1", "--integrators", longest},
        {"tradeoff", "scenes/rope.lua", "-T", "0.1", "--integrators", "verlet,symplectic_euler"},
        {"minimal", "scenes/pendulum1.lua", "-T", "0.2"},
        {"compare", "scenes/pendulum.lua", "-T", "0.2", "-i", "symplectic_euler", "-i", "dopri5",
         "-d", "0.001234567", "--of", "mean sag"}}) {
    std::istringstream lines(run_sim(words).out);
    for (std::string line; std::getline(lines, line);) {
      INFO(line);
      CHECK((line.size() <= 80 || line.starts_with("  sim ")));  // commands are one line
    }
  }
}

// Every key of an object, and of what is inside, but for names that a scene gave.
void keys_of(const Json& value, std::set<std::string>& keys) {
  for (const std::string& key : value.keys) {
    keys.insert(key);
    if (key != "observed" && key != "of") keys_of(value.at(key), keys);
  }
  for (const Json& each : value.list) keys_of(each, keys);
}

TEST_CASE("the keys of --json are those that the help of a study names") {
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"stability", "scenes/pendulum.lua", "--integrators", "rk4"},
        {"order", "rk4", "scenes/pendulum.lua", "-T", "0.1", "--of", "mean sag"},
        {"tradeoff", "scenes/pendulum.lua", "-T", "0.1", "--integrators", "rk4", "--of", "sag"},
        {"minimal", "scenes/pendulum.lua", "-T", "0.1"},
        {"compare", "scenes/pendulum.lua", "-T", "0.1", "--of", "mean sag"}}) {
    INFO(words[0]);
    auto json = words;
    json.push_back("--json");
    const Outcome outcome = run_sim(json);
    REQUIRE(outcome.code == 0);
    std::set<std::string> keys;
    keys_of(JsonReader(outcome.out).read(), keys);
    const std::string all = run_sim({words[0], "--help"}).out;
    const std::string help = all.substr(all.find("Keys of --json"));
    std::set<std::string> named;
    std::string word;
    for (const char c : help)
      if (std::isalnum(static_cast<unsigned char>(c)) || c == '_')
        word += c;
      else
        named.insert(std::exchange(word, ""));
    for (const std::string& key : keys) {
      INFO(key);
      CHECK(named.contains(key));
    }
    CHECK(help.find("confirmed") == std::string::npos);  // which none has
  }
}

// A ball between a room and a sphere (Sinai 1970): two tight runs of 24 s are 0.02 apart in the
// mean, by chance, and those from a rounding away 0.2.
TEST_CASE("no more is claimed of a figure than neighbours leave, with colliders, too") {
  const TemporaryFolder folder;
  write_text(folder.path() / "billiard.lua", R"(
local sim = require "sim"
local ball = sim.particles { mass = 1 }
ball:add({0.3, 0.1, 0}, { velocity = {1.3, 0.7, 0} })
return sim.scene { name = "billiard", particles = ball, forces = {},
  colliders = { sim.collider.box { center = {0, 0, 0}, half = {1, 1, 1}, inside = true,
      restitution = 1 },
    sim.collider.sphere { radius = 0.4, center = {-0.3, -0.2, 0}, restitution = 1 } },
  observe = { x = function(s) return s:position(0)[1] end },
  integrator = "rk4", dt = 0.005, duration = 24, accuracy = "event" })");
  const auto study = [&](const char* time) {
    const Outcome outcome = run_sim({"tradeoff", "billiard.lua", "-T", time, "--of", "mean x",
                                     "--integrators", "rk4", "--json"},
                                    {.folder = folder.path()});
    REQUIRE(outcome.code == 0);
    return JsonReader(outcome.out).read();
  };
  CHECK(study("24").at("reference").at("error").number > 0.1);
  CHECK(study("5").at("reference").at("error").number < 1e-6);
}

TEST_CASE("wrong words for a study are usage errors") {
  const std::vector<std::vector<std::string>> wrong = {
      {"stability", "--integrators", "rk5"},
      {"stability", "--integrators", "rk4,,euler"},
      {"stability", "--integrators", "rk4,rk4"},
      {"stability", "--integrators", "r,rk4:precision=double"},
      {"order", "dopri5:tol=1e-6", "-T", "0.1"},
      {"tradeoff", "--integrators", "tsit5:atol=1e-6"},
      {"stability", "scenes/circle.lua", "--integrators", "verlet"},
      {"stability", "--at", "-1"},
      {"stability", "--time", "1"},
      {"stability", "a.lua", "b.lua"},
      {"stability", "--at", "20", "-i", "euler"},
      {"order", "rk5", "scenes/circle.lua"},
      {"order", "rk4", "scenes/circle.lua", "x"},
      {"tradeoff", "scenes/pendulum.lua", "--of", "sog"},
      {"tradeoff", "--of", "sag"},
      {"tradeoff", "scenes/pendulum.lua", "--of", "median sag"},
      {"tradeoff", "scenes/pendulum.lua", "--of", "sag", "--of", "mean sag"},
      {"scenes/pendulum.lua", "--of", "mean sog"},
      {"minimal", "--without", "flax"},
      {"minimal", "--budget", "1 kg"},
      {"order", "rk4", "--integrators", "euler"},
      {"order", "--time", "0"},
      {"tradeoff", "--budget", "0"},
      {"tradeoff", "--budget", "1 km"},
      {"tradeoff", "--budget", "-1%"},
      {"tradeoff", "--csv", "p.txt"},
      {"tradeoff", "--csv", "-", "--json"},
      {"tradeoff", "scenes/sample.lua", "--svg", "p.svg"},
      {"stability", "scenes/sample.lua", "--svg", "p.svg"},
      {"stability", "--extremes", "--svg", "p.svg"},
      {"tradeoff", "--dt", "0.1"}};
  for (const auto& words : wrong) {
    const Outcome outcome = run_sim(words);
    INFO(words[0] << ' ' << words[1] << ": " << outcome.err);
    CHECK(outcome.code == 2);
    CHECK(outcome.err.rfind("sim: error: ", 0) == 0);
    CHECK(outcome.out.empty());
  }
  CHECK(run_sim({"stability", "scenes/nothing.lua"}).code == 5);
}

TEST_CASE("a study ends on Ctrl-C with what it has") {
  ProgramOptions options;
  options.signal = SIGINT;
  options.signal_at = "%";  // the bar
  const Outcome outcome = run_sim({"order", "--progress", "on", "-s", "n=24"}, options);
  CHECK(outcome.code == 130);
  CHECK(outcome.out.find("system      cloth") != std::string::npos);
  CHECK(outcome.err.find("interrupted: ") != std::string::npos);
}

}  // namespace
}  // namespace sim_test
