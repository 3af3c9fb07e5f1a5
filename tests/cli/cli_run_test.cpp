// The output of a run, and its end.
#include <catch2/catch.hpp>
#include <csignal>
#include <iterator>
#include <regex>
#include <set>
#include <sstream>
#include <thread>

#include "tests/cli/json_check.h"
#include "tests/cli/program.h"
#include "tests/support/temporary.h"

namespace sim_test {
namespace {

void check_width(const std::string& text) {
  for (const std::string& line : lines_of(text)) {
    INFO(line);
    CHECK(line.size() <= 80);
  }
}

TEST_CASE("the report of a run is short and fits a terminal") {
  // In the scene's own folder, so that the line of its file is short.
  const Outcome outcome = run_sim({"scenes/cloth.lua"}, {.folder = SIM_SOURCE_DIR "/scripts"});
  CHECK(outcome.code == 0);
  const auto lines = lines_of(outcome.out);
  REQUIRE(lines.size() == 5 + 2 + 11 + 3 + 1);
  CHECK(lines[1] == "particles   64, 2 pinned");
  CHECK(lines[2] == "springs     306: 112 structural, 98 shear, 96 flex");
  CHECK(lines[3] == "integrator  rk4, order 4, 4 evaluations a step");
  CHECK(lines[4] == "step        0.005 s, 400 steps to t = 2 s");
  for (const char* column : {"step", "t [s]", "kinetic", "potential", "total", "work", "drift [J]"})
    CHECK(lines[6].find(column) != std::string::npos);
  for (std::size_t row = 7; row < 18; ++row) CHECK(lines[row].size() == lines[6].size());
  CHECK(lines_of(outcome.err).size() == 1);
  CHECK(outcome.err.rfind("trusted: ", 0) == 0);
  check_width(outcome.out.substr(0, outcome.out.rfind("trusted: ")));  // words may be longer
}

TEST_CASE("what stands still on something is trusted") {
  const Outcome outcome = run_sim({"scenes/stack.lua", "-T", "2"});
  CHECK(outcome.code == 0);
  CHECK_THAT(outcome.out, Catch::Contains("trusted: "));
  CHECK_THAT(outcome.out, Catch::Contains("hardly anything moves"));
}

TEST_CASE("the positional integrator and step read like the options") {
  const Outcome words = run_sim({"scenes/sample.lua", "r", "0.005", "-n", "50", "--dump", "-q"});
  const Outcome options =
      run_sim({"--steps=50", "scenes/sample.lua", "-irk4", "--dt", "5e-3", "--dump", "-q"});
  CHECK(words.code == 0);
  CHECK(words.out == options.out);
  CHECK(words.out != run_sim({"scenes/sample.lua", "t", "0.005", "-n", "50", "--dump", "-q"}).out);
}

TEST_CASE("threads do not change a bit of a dump") {
  const Outcome one =
      run_sim({"-s", "n=40", "-d", "0.0005", "-n", "20", "--dump", "-q", "-j", "1"});
  CHECK(one.code == 0);
  CHECK(one.out ==
        run_sim({"-s", "n=40", "-d", "0.0005", "-n", "20", "--dump", "-q", "-j", "3"}).out);
}

TEST_CASE("a run takes as many threads as pay, and says how many") {
  const std::vector<std::string> run = {"-s",     "n=64", "-d",   "1e-4",  "-i",
                                        "verlet", "-n",   "2000", "--json"};
  const std::vector<std::string> wishes[] = {{"-j", "1"}, {}, {"-j", "auto"}, {"--threads=auto"}};
  std::set<std::string> hashes;
  for (const auto& wish : wishes) {
    std::vector<std::string> own = run;
    own.insert(own.end(), wish.begin(), wish.end());
    const Outcome outcome = run_sim(own);
    CHECK(outcome.code == 0);
    const Json report = JsonReader(outcome.out).read();
    hashes.insert(report.at("systems").list.at(0).at("hash").text);
    const double threads = report.at("threads").number;
    if (wish == wishes[0]) CHECK(threads == 1);
    CHECK((threads >= 1 && threads <= std::max(1u, std::thread::hardware_concurrency())));
  }
  CHECK(hashes.size() == 1);
  // 16 x 16 particles are at work for one.
  const Outcome small = run_sim({"-s", "n=16", "-n", "20", "--json"});
  CHECK(JsonReader(small.out).read().at("threads").number == 1);
}

TEST_CASE("a table changes nothing of what a run says") {
  // Without one the steps between two rows are taken several at once; 16900 particles, so that the
  // work of drag is not looked at after each.
  const std::vector<std::string> run = {"-s", "n=130", "-i", "verlet", "-d", "1e-4", "-n", "334"};
  const Outcome alone = run_sim(run);
  std::vector<std::string> with_table = run;
  const TemporaryFolder folder;
  const std::string file = folder.path() / "energy.csv";
  with_table.insert(with_table.end(), {"--energy=" + file, "--every", "5"});
  const Outcome table = run_sim(with_table);
  const auto without_time = [](const std::string& text) {
    std::string rest;
    for (const std::string& line : lines_of(text))
      if (line.rfind("ran ", 0) != 0) rest += line + "\n";
    return rest;
  };
  CHECK(alone.code == 0);
  CHECK(without_time(alone.out) == without_time(table.out));
  CHECK(alone.err == table.err);
  CHECK(alone.err.rfind("trusted: ", 0) == 0);
  CHECK(lines_of(read_text(file)).size() == 1 + 1 + 334 / 5 + 1);
}

TEST_CASE("the summary as JSON") {
  const Outcome outcome = run_sim({"scenes/sample.lua", "--json", "-n", "10"});
  CHECK(outcome.code == 0);
  REQUIRE(lines_of(outcome.out).size() == 1);
  const Json summary = read_json(outcome.out);
  const auto& systems = summary.at("systems").list;
  REQUIRE(systems.size() == 3);
  CHECK(systems[0].at("name").text == "circle");
  CHECK(!systems[0].has("energy"));
  CHECK(systems[0].at("error").number < 1e-4);
  CHECK(systems[1].at("springs").at("shear").number == 98);
  const Json& energy = systems[1].at("energy");
  CHECK(energy.at("work").number > 0);  // drag takes it
  CHECK(energy.at("drift").number ==
        energy.at("end").number + energy.at("work").number - energy.at("start").number);
  CHECK(std::abs(energy.at("drift").number) < 1e-6 * energy.at("work").number);
  CHECK(systems[2].at("steps").number == 10);
  CHECK(systems[2].at("hash").text.size() == 16);
  CHECK(summary.at("verdict").text == "trusted");
  CHECK(outcome.err.find("system      cloth") != std::string::npos);
}

TEST_CASE("a run that leaves the finite numbers stops and keeps its last frame") {
  const TemporaryFolder folder;
  const Outcome outcome = run_sim({"scenes/cloth.lua", "euler", "0.005", "-T", "20", "--dump=d.csv",
                                   "--energy=e.csv", "--every", "7", "--json"},
                                  {.folder = folder.path()});
  CHECK(outcome.code == 4);
  const auto words = lines_of(outcome.err);
  REQUIRE(words.size() > 2);
  CHECK(outcome.err.find("\nsim: error: diverged: ") != std::string::npos);
  CHECK(words.back().rfind("diverged: particle ", 0) == 0);
  const Json summary = read_json(outcome.out);
  const auto steps = static_cast<long>(summary.at("systems").list[0].at("steps").number);
  CHECK(steps > 100);
  CHECK(steps < 4000);
  CHECK(words.back().find("after step " + std::to_string(steps + 1) + ", t = ") !=
        std::string::npos);
  CHECK(words.back().find("h = 0.005 s") != std::string::npos);
  CHECK(summary.at("verdict").text == "diverged");

  for (const char* name : {"d.csv", "e.csv"}) {
    const std::string table = read_text(folder.path() / name);
    CHECK(table.find("nan") == std::string::npos);
    CHECK(table.find("inf") == std::string::npos);
  }
  const auto rows = lines_of(read_text(folder.path() / "d.csv"));
  CHECK(cells_of(rows.back())[0] == std::to_string(steps));
  CHECK(cells_of(rows.back())[2] == "63");
  CHECK(rows.size() == 1 + 64 * static_cast<std::size_t>((steps + 6) / 7 + 1));
  CHECK(files_in(folder.path()) == 2);
}

TEST_CASE("a run that diverges tells the command that writes the last state before") {
  const TemporaryFolder folder;
  const Outcome outcome = run_sim({"scenes/cloth.lua", "euler", "0.02", "-s", "n=4", "-T", "20"});
  CHECK(outcome.code == 4);
  std::smatch first, look;
  REQUIRE(std::regex_search(outcome.err, first, std::regex("\n  first .*, step ([0-9]+),")));
  REQUIRE(std::regex_search(outcome.err, look, std::regex("\n  look +sim (.*)\n")));
  std::istringstream words(look[1].str());
  const std::vector<std::string> command{std::istream_iterator<std::string>(words), {}};
  CHECK(run_sim(command, {.folder = folder.path()}).code == 0);
  const auto rows = lines_of(read_text(folder.path() / "before.csv"));
  CHECK(std::stol(cells_of(rows.back())[0]) == std::stol(first[1]) - 1);
}

TEST_CASE("verdicts say what was seen") {
  const Outcome quiet = run_sim({"-q", "-n", "100"});
  CHECK(quiet.out.empty());
  CHECK(quiet.err.empty());
  // Forward Euler widens the circle by sqrt(1 + h^2) a step: 5 % in 10 s.
  const Outcome circle = run_sim({"scenes/circle.lua", "euler", "-q"});
  CHECK(circle.code == 0);
  CHECK(circle.err.rfind("suspect: off by about ", 0) == 0);
  CHECK(circle.err.find("; largest error ") != std::string::npos);
  const Outcome cloth = run_sim({"scenes/cloth.lua", "euler", "-q"});
  CHECK(cloth.code == 4);
  CHECK(cloth.err.find("\ndiverged: energy rose by ") != std::string::npos);
  // Without drag the trapezoidal rule gains energy at any step, at first slowly.
  const Outcome gain = run_sim({"scenes/pendulum1.lua", "trapezoid", "0.05", "-q", "-T", "60"});
  CHECK(gain.code == 0);
  CHECK(gain.err.rfind("suspect: ", 0) == 0);
  CHECK(gain.err.find("energy rose by ") != std::string::npos);
  CHECK(run_sim({"scenes/pendulum1.lua", "rk4"}).err.rfind("trusted: positions to ", 0) == 0);
  // RK4 with long steps loses energy, which no force of this scene takes.
  const Outcome loss = run_sim({"scenes/pendulum1.lua", "rk4", "0.1", "-q", "-T", "100"});
  CHECK(loss.err.rfind("suspect: ", 0) == 0);
  CHECK(loss.err.find("energy fell by ") != std::string::npos);
  const TemporaryFolder folder;
  write_text(folder.path() / "s.lua",
             "local sim = require 'sim'\nreturn sim.scene { name = 's', state = { 1 }, dt = 0.1,\n"
             "  integrator = 'rk4', duration = 1, field = sim.field.lua { function(t, x)\n"
             "    return { -x[1] } end } }\n");
  CHECK(run_sim({"s.lua"}, {.folder = folder.path()}).err ==
        "trusted: numbers to 3e-07 (verified), dt 3.6 % of limit\n");
  CHECK(run_sim({"s.lua", "--no-verify"}, {.folder = folder.path()}).err ==
        "unverified: dt 3.6 % of limit; positions not verified\n");
  const auto said = [&](std::vector<std::string> words) {
    words.insert(words.begin(), "s.lua");
    return run_sim(words, {.folder = folder.path()});
  };
  CHECK(said({"--no-verify"}).code == 0);
  CHECK(JsonReader(said({"--no-verify", "--json"}).out).read().at("verdict").text == "unverified");
  CHECK(said({"--check", "verified"}).code == 0);
  const Outcome asked = said({"--no-verify", "--check", "verified,dt=90%"});
  CHECK(asked.code == 8);
  CHECK(asked.err.find("s, verified: the run is unverified: dt 3.6 % of limit; positions not "
                       "verified; add --verify") != std::string::npos);
  // The initial state is as exact as can be.
  CHECK(said({"--no-verify", "-n", "0", "--check", "verified"}).code == 0);
  CHECK(said({"--verify", "--no-verify"}).code == 2);
  CHECK(said({"--verify-time", "1min"}).err.rfind("trusted: ", 0) == 0);
  CHECK(said({"--verify-time", "50%"}).code == 0);
  for (const char* wrong : {"0", "-1s", "soon", "-5%", "%", "nan%", "1e999"}) {
    const Outcome refused = said({std::string("--verify-time=") + wrong});
    INFO(refused.err);
    CHECK(refused.code == 2);
    CHECK(refused.err.find("--verify-time '") != std::string::npos);
  }
}

TEST_CASE("a run that diverged is explained, with a step that works") {
  const Outcome outcome = run_sim({"-i", "euler"});
  CHECK(outcome.code == 4);
  for (const char* words : {"what happened in cloth\n", "% of the largest stable one at the start",
                            " spring ", " a step", "on particle ", "sim scenes/cloth.lua -i euler"})
    CHECK(outcome.err.find(words) != std::string::npos);
  const auto at = outcome.err.find("works     --dt ");
  REQUIRE(at != std::string::npos);
  std::istringstream said(outcome.err.substr(at));
  std::string word, dt;
  said >> word >> word >> dt;
  const Outcome again = run_sim({"-i", "euler", "-d", dt});
  CHECK(again.err.rfind("trusted: ", 0) == 0);

  const Outcome machine = run_sim({"-i", "euler", "--json"});
  const Json post_mortem = JsonReader(machine.out).read().at("postmortem");
  CHECK(post_mortem.at("dt_share").number == Approx(92.8).epsilon(0.01));
  CHECK(post_mortem.at("smaller").at("verdict").text == "trusted");
  // Quiet runs do not try anything.
  CHECK(run_sim({"-i", "euler", "-q"}).err.find("what happened") == std::string::npos);
}

TEST_CASE("the verdict is part of the report, wherever the words go") {
  const Outcome outcome = run_sim({"-n", "20"});
  CHECK(outcome.err.rfind("trusted: ", 0) == 0);
  CHECK(lines_of(outcome.out).back() + "\n" == outcome.err);
  // Standard output with data has nothing else in it.
  for (const char* data : {"--dump", "--energy", "--json"}) {
    const Outcome table = run_sim({"-n", "20", data});
    CHECK(table.out.find("trusted: ") == std::string::npos);
    CHECK(table.err.find("\ntrusted: ") != std::string::npos);
  }
  CHECK(run_sim({"-n", "20", "-q"}).out.empty());
}

TEST_CASE("a world in which one system diverges runs the others to their end") {
  const TemporaryFolder folder;
  write_text(
      folder.path() / "w.lua",
      "local sim = require 'sim'\n"
      "local cloth = require 'scenes.cloth'\ncloth.integrator = 'euler'\n"
      "local other = require 'scenes.cloth'\nother.dt = 0.05\n"
      "return sim.world { bad = cloth, pendulum = require 'scenes.pendulum1', worse = other }\n");
  const Outcome outcome = run_sim({"w.lua", "-T", "4"}, {.folder = folder.path()});
  INFO(outcome.err);
  CHECK(outcome.code == 4);
  for (const char* words :
       {"what happened in bad\n", "what happened in worse\n", "\ntrusted: pendulum: positions to ",
        "\ndiverged: bad: ", "\ndiverged: worse: "})
    CHECK(outcome.err.find(words) != std::string::npos);
  CHECK(lines_of(outcome.err).back().rfind("diverged: ", 0) == 0);
  const Outcome machine = run_sim({"w.lua", "-T", "4", "--json"}, {.folder = folder.path()});
  const Json summary = JsonReader(machine.out).read();
  const auto& systems = summary.at("systems").list;
  REQUIRE(systems.size() == 3);
  CHECK(systems[1].at("t").number == Approx(4));
  CHECK(systems[1].at("verdict").text == "trusted");
  CHECK(systems[0].at("postmortem").at("integrator").text == "euler");
  CHECK(systems[2].at("postmortem").at("integrator").text == "rk4");
}

TEST_CASE("--check of what is not there fails, and strain is not the step's fault") {
  const Outcome none = run_sim({"scenes/double_well.lua", "-n", "5", "--check", "strain=5%"});
  CHECK(none.code == 8);
  CHECK(none.err.find("nothing to check: the system has no springs") != std::string::npos);
  const Outcome strained = run_sim({"--check", "strain=1%", "-q"});
  CHECK(strained.err.find("smaller --dt") == std::string::npos);
  CHECK(strained.err.find("stiffer springs") != std::string::npos);
}

TEST_CASE("the cloth is stable at its own step, whatever its size and stiffness") {
  for (const char* setting :
       {"n=2", "n=3", "n=5", "n=16", "n=33", "n=64", "structural=1e5", "flex=1e4"}) {
    const Outcome outcome = run_sim({"scenes/cloth.lua", "-s", setting, "-T", "0.5"});
    INFO(setting << '\n' << outcome.err);
    CHECK(outcome.err.rfind("trusted: ", 0) == 0);
  }
}

TEST_CASE("a double pendulum and linearised steps of an implicit method are not trusted") {
  const TemporaryFolder folder;
  write_text(
      folder.path() / "d.lua",
      "local sim = require 'sim'\nlocal b = sim.particles { mass = 1 }\n"
      "local o, p, q = b:add {0, 0, 0}, b:add {1, 0, 0}, b:add {2, 0.1, 0}\nb:pin(o)\n"
      "local rod = sim.force.spring { stiffness = 1e4, rest = 1, ties = { {o, p}, {p, q} } }\n"
      "return sim.scene { particles = b, forces = { sim.force.gravity {}, rod },\n"
      "  integrator = 'implicit_midpoint', dt = 0.01, duration = 6 }\n");
  for (const char* method : {"implicit_midpoint", "implicit_euler:newton_steps=1"}) {
    const Outcome outcome = run_sim({"d.lua", "-i", method}, {.folder = folder.path()});
    INFO(outcome.err);
    CHECK(outcome.err.rfind("trusted: ", 0) != 0);
  }
}

TEST_CASE("--check turns a limit into exit code 8") {
  CHECK(run_sim({"--check", "energy=1%,strain=100%,dt=90%", "-q"}).code == 0);
  for (const char* limit : {"energy=1e-9%", "strain=1%", "dt=0.1"}) {
    const Outcome outcome = run_sim({"--check", limit, "-q"});
    INFO(outcome.err);
    CHECK(outcome.code == 8);
    CHECK(outcome.err.rfind("sim: error: check failed: cloth, ", 0) == 0);
  }
  // A bound that cannot be checked counts as missed; a run that diverged is worse than that.
  CHECK(run_sim({"scenes/circle.lua", "--check", "energy=1%", "-q"}).code == 8);
  CHECK(run_sim({"-i", "euler", "--check", "energy=1%", "-q"}).code == 4);
  for (const char* wrong :
       {"energy", "energy=", "energy=-1%", "speed=1%", "dt=1%,dt=2%", "dt=nan", ",", "dt=90%,"})
    CHECK(run_sim({"--check", wrong}).code == 2);
}

TEST_CASE("an exact solution of the wrong size is an error of the scene") {
  const TemporaryFolder folder;
  write_text(folder.path() / "s.lua",
             "local sim = require 'sim'\nreturn sim.scene { name = 's', state = { 1, 2 },\n"
             "  dt = 0.1, integrator = 'rk4', duration = 1, exact = function(t) return { 1 } end,\n"
             "  field = sim.field.lua { function(t, x) return { 0, 0 } end } }\n");
  const Outcome outcome = run_sim({"s.lua", "--dump=o.csv"}, {.folder = folder.path()});
  CHECK(outcome.code == 3);
  CHECK(outcome.err.rfind("sim: error: ", 0) == 0);
  CHECK(files_in(folder.path()) == 1);
}

TEST_CASE("signals end a run after its step, with its tables") {
  for (const int signal : {SIGINT, SIGTERM}) {
    const TemporaryFolder folder;
    ProgramOptions options{.folder = folder.path()};
    options.signal = signal;
    options.signal_at = "real time";  // the progress line: the run is under way
    const Outcome outcome = run_sim(
        {"-T", "1e8", "--dump=d.csv", "--every", "1000000000", "--progress", "on"}, options);
    CHECK(outcome.code == 128 + signal);
    CHECK(outcome.err.find("suspect: interrupted at t = ") != std::string::npos);
    const auto rows = lines_of(read_text(folder.path() / "d.csv"));
    CHECK(rows.size() == 1 + 2 * 64);
    CHECK(std::stol(cells_of(rows.back())[0]) > 0);
    CHECK(files_in(folder.path()) == 1);
  }
}

TEST_CASE("progress is shown when asked for and cleared behind") {
  ProgramOptions options;
  options.signal = SIGINT;
  options.signal_at = "real time";
  const Outcome shown = run_sim({"-T", "1e8", "--progress", "on"}, options);
  CHECK(shown.err.find("\rt = ") != std::string::npos);
  CHECK(lines_of(shown.err).back().find("\r\x1b[Ksuspect: ") != std::string::npos);
  // No terminal, or not wanted: a run of half a second shows nothing.
  for (const char* when : {"auto", "off"})
    CHECK(run_sim({"-T", "1000", "--progress", when}).err.find('\r') == std::string::npos);
}

TEST_CASE("a reader that goes away ends the run without words") {
  const TemporaryFolder folder;
  ProgramOptions options{.folder = folder.path()};
  options.close_after = 1;
  const Outcome outcome = run_sim({"-T", "1e6", "--dump", "--energy=e.csv", "-q"}, options);
  CHECK(outcome.code == 141);
  CHECK(outcome.err.empty());
  CHECK(files_in(folder.path()) == 0);
  // The same through a file name that stands for the pipe.
  const Outcome file = run_sim({"-T", "1e6", "--dump=/dev/../dev/fd/1", "-q"}, options);
  CHECK(file.code == 141);
  CHECK(file.err.empty());
}

}  // namespace
}  // namespace sim_test
