// sim sweep and sim plot, as a user runs them.
#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "core/output/format.h"
#include "tests/cli/json_check.h"
#include "tests/cli/program.h"
#include "tests/support/temporary.h"

namespace sim_test {
namespace {

namespace fs = std::filesystem;
using Catch::Contains;
using sim::csv_fields;

struct Sheet {
  std::vector<std::string> names;
  std::vector<std::vector<std::string>> rows;

  const std::string& at(std::size_t row, const std::string& name) const {
    const auto found = std::find(names.begin(), names.end(), name);
    REQUIRE(found != names.end());
    return rows.at(row).at(static_cast<std::size_t>(found - names.begin()));
  }
};

Sheet sheet(const std::string& text) {
  Sheet sheet;
  std::istringstream in(text);
  std::string line;
  std::getline(in, line);
  sheet.names = csv_fields(line);
  while (std::getline(in, line)) sheet.rows.push_back(csv_fields(line));
  return sheet;
}

// Without the last column, seconds.
std::string without_seconds(const std::string& text) {
  std::istringstream in(text);
  std::string line, out;
  while (std::getline(in, line)) out += line.substr(0, line.rfind(',')) + '\n';
  return out;
}

const std::vector<std::string> kPendulums{
    "sweep",  "scenes/pendulum1.lua",        "-T",     "1",
    "--over", "integrator=rk4,verlet,euler", "--over", "dt=0.005:0.02:log3"};

std::vector<std::string> with(std::vector<std::string> words,
                              const std::vector<std::string>& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

}  // namespace

TEST_CASE("a sweep is the product of its axes, and a row is what a run says") {
  const Outcome outcome = run_sim(kPendulums);
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
  const Sheet table = sheet(outcome.out);
  REQUIRE(table.rows.size() == 9);
  CHECK(table.at(4, "integrator") == "verlet");
  CHECK(table.at(4, "dt") == "0.01");
  const Outcome run = run_sim(
      {"scenes/pendulum1.lua", "-T", "1", "-i", "verlet", "-d", "0.01", "--json", "--verify"});
  const Json one = JsonReader(run.out).read().at("systems").list.front();
  CHECK(table.at(4, "hash") == one.at("hash").text);
  CHECK(table.at(4, "verdict") == one.at("verdict").text);
  CHECK(table.at(4, "steps") == "100");
  CHECK(std::stod(table.at(4, "drift")) == one.at("energy").at("drift").number);
  CHECK(std::stod(table.at(4, "error")) ==
        Approx(one.at("figures").at("position_error").number).epsilon(1e-12));
  // Order 4, from the table alone.
  CHECK(std::stod(table.at(2, "error")) / std::stod(table.at(1, "error")) ==
        Approx(16).epsilon(0.15));
}

TEST_CASE("processes, parts and a sweep that goes on make the same table") {
  const TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  REQUIRE(run_sim(with(kPendulums, {"--out", "a.csv"}), here).code == 0);
  REQUIRE(run_sim(with(kPendulums, {"--out", "b.csv", "-j", "3"}), here).code == 0);
  for (const char* part : {"2/3", "0/3", "1/3"})
    REQUIRE(run_sim(with(kPendulums, {"--out", "c.csv", "--part", part}), here).code == 0);
  CHECK_FALSE(fs::exists(folder.path() / "c.csv"));
  REQUIRE(run_sim(with(kPendulums, {"--out", "c.csv", "--collect"}), here).code == 0);
  const std::string whole = without_seconds(read_text(folder.path() / "a.csv"));
  CHECK(std::count(whole.begin(), whole.end(), '\n') == 10);
  CHECK(without_seconds(read_text(folder.path() / "b.csv")) == whole);
  CHECK(without_seconds(read_text(folder.path() / "c.csv")) == whole);

  // One case is gone, one cut off, one of another key: these alone are run again.
  const fs::path cases = folder.path() / "a.cases";
  fs::remove(cases / "000001.csv");
  const std::string kept = read_text(cases / "000002.csv");
  std::ofstream(cases / "000002.csv") << kept.substr(0, kept.size() - 1);
  std::ofstream(cases / "000003.csv") << "0123456789abcdef" << kept.substr(16);
  const Outcome again = run_sim(with(kPendulums, {"--out", "a.csv"}), here);
  CHECK(again.code == 0);
  CHECK_THAT(again.err, Contains("9 cases, 6 of them kept"));
  CHECK(without_seconds(read_text(folder.path() / "a.csv")) == whole);
  // Another question: nothing is kept.
  CHECK_THAT(run_sim(with(kPendulums, {"--out", "a.csv", "-s", "mass=2"}), here).err,
             !Contains("kept"));
  CHECK(run_sim(with(kPendulums, {"--out", "d.csv", "--collect"}), here).code == 9);
}

TEST_CASE("cases of formulas run side by side, and their rows are those of one by one") {
  const TemporaryFolder folder;
  const std::string scene = (folder.path() / "forced.lua").string();
  std::ofstream(scene)
      << "local sim = require 'sim'\n"
         "local a, b = sim.arg('a', 1, ''), sim.arg('b', 0.5, '')\n"
         "return sim.scene { name = 'forced', state = { b, 0 },\n"
         "  field = sim.field.formula { 'v', 'cos(2*t) - a*x - 0.1*v',\n"
         "    names = {'x', 'v'}, a = a }, integrator = 'rk4', dt = 0.05,\n"
         "  duration = 20, observe = { x = function(s) return s:component(0) end } }\n";
  // With a time limit each case has a process of its own. Steps of 0.13 s are too long for some; of
  // a = 0 and 1 the formulas are others.
  const std::vector<std::vector<std::string>> sweeps{
      {"sweep", "scenes/lorenz.lua", "-T", "8", "--dt", "0.13", "--over", "r=1:200:lin11", "--over",
       "s=1,10"},
      {"sweep", "scenes/lorenz.lua", "-T", "8", "--no-verify", "--over", "r=20:30:lin13"},
      {"sweep", scene, "--over", "a=0,1,2,3,4.5", "--over", "b=0,0.5,1"}};
  for (const auto& words : sweeps) {
    const Outcome together = run_sim(with(words, {"-j", "2"}));
    const Outcome alone = run_sim(with(words, {"-j", "2", "--timeout", "1000"}));
    REQUIRE(alone.code == 0);
    CHECK(together.code == 0);
    CHECK(without_seconds(together.out) == without_seconds(alone.out));
  }
}

TEST_CASE("a case that fails, hangs or diverges is a row, and the others go on") {
  const TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  std::ofstream(folder.path() / "cases.csv") << "integrator,stiffness,time\n"
                                                "rk4,100,1\n"
                                                "nonsense,100,1\n"
                                                "rk4,1e300,1\n"
                                                "\"dopri5:tol=1e-6,atol=1e-6\",100,1\n"
                                                "rk4,100,1e9\n";
  const Outcome outcome = run_sim({"sweep", "scenes/pendulum1.lua", "--cases", "cases.csv",
                                   "--timeout", "1.5", "-j", "2", "--out", "t.csv"},
                                  here);
  CHECK(outcome.code == 9);
  CHECK_THAT(outcome.err, Contains("5 cases, 2 failed"));
  const Sheet table = sheet(read_text(folder.path() / "t.csv"));
  REQUIRE(table.rows.size() == 5);
  CHECK(table.at(0, "exit") == "0");
  CHECK(table.at(1, "exit") == "2");
  CHECK_THAT(table.at(1, "reason"), Contains("unknown integrator 'nonsense'"));
  CHECK(table.at(2, "exit") == "4");
  CHECK(table.at(2, "error").empty());
  CHECK(table.at(3, "verdict") == "trusted");
  CHECK(table.at(4, "exit") == "124");
}

namespace {

// A particle that falls through air, with a module, a figure and a switch.
void write_falling(const fs::path& folder) {
  write_text(folder / "fall.lua",
             "local sim = require 'sim'\n"
             "local air = require 'air'\n"
             "local p = sim.particles { mass = sim.arg('mass', 1, 'kg') }\n"
             "p:add {0, 0, 0}\n"
             "local drag = sim.force.drag { k = air.k }\n"
             "return sim.scene { name = 'fall', particles = p,\n"
             "  forces = { sim.force.gravity { g = {0, -9.81, 0} }, drag },\n"
             "  switches = { air = drag },\n"
             "  observe = { height = function(s) return s:position(0)[2] end },\n"
             "  integrator = 'rk4', dt = 0.01, duration = 0.1 }\n");
  write_text(folder / "air.lua", "return { k = 0.1 }\n");
}

const std::vector<std::string> kFalls{"sweep",       "fall.lua", "--over", "mass=1,2",
                                      "--no-verify", "--out",    "t.csv"};

// The number of the two cases that were kept.
int kept(const Outcome& outcome) {
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
  const auto at = outcome.err.find(" of them kept");
  return at == std::string::npos ? 0 : outcome.err[at - 1] - '0';
}

}  // namespace

TEST_CASE("rows are kept as long as all that was read for them is the same") {
  const TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  write_falling(folder.path());
  const std::string plugin = std::string(SIM_FIXTURE_DIR) + "/air_drag/air_drag.so";
  fs::copy_file(plugin, folder.path() / "mine.so");
  const std::vector<std::string> words = with(kFalls, {"--load", "mine.so"});
  CHECK(kept(run_sim(words, here)) == 0);
  CHECK(kept(run_sim(words, here)) == 2);

  // A module.
  const std::string before = read_text(folder.path() / "t.csv");
  write_text(folder.path() / "air.lua", "return { k = 5 }\n");
  Outcome again = run_sim(words, here);
  CHECK(kept(again) == 0);
  CHECK_THAT(again.err, Contains("module 'air'") && Contains("has changed"));
  CHECK(sheet(read_text(folder.path() / "t.csv")).at(0, "hash") != sheet(before).at(0, "hash"));
  CHECK(kept(run_sim(words, here)) == 2);

  // A module that is found at a path where there was none.
  fs::create_directory(folder.path() / "lib");
  write_text(folder.path() / "fall.lua",
             "local far = require 'far'\n" + read_text(folder.path() / "fall.lua"));
  fs::create_directories(folder.path() / "path" / "sim");
  write_text(folder.path() / "path" / "far.lua", "return 1\n");
  ProgramOptions path = here;
  path.environment = {{"SIM_PATH", (folder.path() / "path").string()}};
  CHECK(kept(run_sim(words, path)) == 0);
  CHECK(kept(run_sim(words, path)) == 2);
  write_text(folder.path() / "far.lua", "return 1\n");
  CHECK(kept(run_sim(words, path)) == 0);

  // A plugin that was built again: the bytes are others, and so is its checksum.
  std::string library = read_text(folder.path() / "mine.so");
  library.resize(library.rfind("SIM-PLUGIN-MD5 "));
  fs::remove(folder.path() / "mine.so");
  write_text(folder.path() / "mine.so", library + "built again");
  again = run_sim(words, path);
  CHECK(kept(again) == 0);
  CHECK_THAT(again.err, Contains("mine.so) has changed"));
}

TEST_CASE("a kept row that is damaged is not used, and said") {
  const TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  write_falling(folder.path());
  REQUIRE(run_sim(kFalls, here).code == 0);
  const std::string whole = without_seconds(read_text(folder.path() / "t.csv"));
  const fs::path row = folder.path() / "t.cases" / "000001.csv";
  const std::string bytes = read_text(row);
  for (std::size_t at = 0; at < bytes.size(); at += bytes.size() / 12) {
    INFO(at);
    std::string spoilt = bytes;
    spoilt[at] ^= 1;
    write_text(row, spoilt);
    const Outcome again = run_sim(kFalls, here);
    CHECK(kept(again) == 1);
    CHECK_THAT(again.err, Contains("000001.csv is damaged"));
    CHECK(without_seconds(read_text(folder.path() / "t.csv")) == whole);
  }
  for (const std::string& other : {std::string(), bytes.substr(0, 20), bytes + "x"}) {
    write_text(row, other);
    CHECK(kept(run_sim(kFalls, here)) == 1);
  }
}

TEST_CASE("a case that failed is tried again, unless --keep-failed says otherwise") {
  const TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  const std::vector<std::string> words{
      "sweep", "scenes/pendulum1.lua", "--over", "time=1,1e9", "--timeout", "1", "--out",
      "t.csv", "--no-verify"};
  const Outcome first = run_sim(words, here);
  CHECK(first.code == 9);
  CHECK_THAT(first.err, Contains("2 cases, 1 failed"));
  const Outcome keeping = run_sim(with(words, {"--keep-failed"}), here);
  CHECK(keeping.code == 9);
  CHECK_THAT(keeping.err, Contains("2 of them kept"));
  CHECK_THAT(run_sim(with(words, {"--collect"}), here).err, Contains("2 of them kept"));
  const Outcome again = run_sim(words, here);
  CHECK(again.code == 9);
  CHECK_THAT(again.err, Contains("1 of them kept"));
  CHECK(sheet(read_text(folder.path() / "t.csv")).at(1, "exit") == "124");

  // A run that diverged has ended: another try would not change it.
  const std::vector<std::string> wild{
      "sweep", "scenes/pendulum1.lua", "--over", "stiffness=1e300", "--out", "u.csv", "-T", "1"};
  REQUIRE(run_sim(wild, here).code == 0);
  CHECK_THAT(run_sim(wild, here).err, Contains("1 of them kept"));
}

namespace {

// The only child of a process, once it has one.
pid_t child_of(pid_t parent) {
  const std::string list =
      "/proc/" + std::to_string(parent) + "/task/" + std::to_string(parent) + "/children";
  for (int i = 0; i < 1000; ++i, usleep(10'000)) {
    std::ifstream in(list);
    if (pid_t child = 0; in >> child) return child;
  }
  return 0;
}

// It is gone, or waits for nothing but to be noticed.
bool has_gone(pid_t process) {
  std::ifstream in("/proc/" + std::to_string(process) + "/stat");
  std::string text;
  if (!std::getline(in, text)) return true;
  const char state = text[text.rfind(')') + 2];
  return state == 'Z' || state == 'X';
}

}  // namespace

TEST_CASE("the cases of a sweep end when it is killed") {
  const pid_t sweep = fork();
  REQUIRE(sweep >= 0);
  if (sweep == 0) {
    const int nothing = open("/dev/null", O_RDWR);
    program_detail::become({"sweep", "scenes/pendulum1.lua", "--over", "time=1e9"}, {}, nothing,
                           nothing, nothing);
  }
  const pid_t at_work = child_of(sweep);
  REQUIRE(at_work > 0);
  kill(sweep, SIGKILL);
  waitpid(sweep, nullptr, 0);
  bool gone = false;
  for (int i = 0; i < 1000 && !(gone = has_gone(at_work)); ++i) usleep(10'000);
  CHECK(gone);
  if (!gone) kill(at_work, SIGKILL);
}

namespace {

// A trial of an option of a sweep: the words compared, and whether rows depend on it.
struct Trial {
  std::vector<std::string> without, with;
  bool changes_rows;
};

// The options that a sweep takes, as its help declares them.
std::vector<std::string> options_of_sweep() {
  const std::string help = run_sim({"sweep", "--help"}).out;
  const std::size_t begin = help.find("Options:"), end = help.find("as in sim --help");
  REQUIRE(end != std::string::npos);
  std::set<std::string> names;
  const std::string part = help.substr(begin, end - begin);
  const std::regex word("--[a-z][a-z-]*");
  for (std::sregex_iterator it(part.begin(), part.end(), word), none; it != none; ++it)
    names.insert(it->str());
  return {names.begin(), names.end()};
}

}  // namespace

TEST_CASE("each option of a sweep that changes rows is in their key, and no other") {
  const TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  write_falling(folder.path());
  fs::create_directory(folder.path() / "plugins");
  const std::string plugin = std::string(SIM_FIXTURE_DIR) + "/air_drag/air_drag.so";
  write_text(folder.path() / "cases.csv", "mass\n5\n6\n");
  const std::map<std::string, Trial> trials{
      {"--check", {{}, {"--check", "energy=50%"}, true}},
      {"--dt", {{}, {"--dt", "0.02"}, true}},
      {"--integrator", {{}, {"--integrator", "verlet"}, true}},
      {"--no-verify", {{}, {"--no-verify"}, true}},
      {"--of", {{}, {"--of", "max height"}, true}},
      {"--steps", {{}, {"--steps", "7"}, true}},
      {"--time", {{}, {"--time", "0.2"}, true}},
      {"--tol", {{"-i", "dopri5"}, {"-i", "dopri5", "--tol", "1e-4"}, true}},
      {"--set", {{}, {"--set", "air.k=1"}, true}},
      {"--seed", {{}, {"--seed", "3"}, true}},
      {"--without", {{}, {"--without", "drag"}, true}},
      {"--off", {{}, {"--off", "air"}, true}},
      {"--safe", {{}, {"--safe"}, true}},
      {"--plugin-path", {{}, {"--plugin-path", "plugins"}, true}},
      {"--load", {{}, {"--load", plugin}, true}},
      {"--over", {{"--over", "mass=1,2"}, {"--over", "mass=3,4"}, true}},
      {"--cases", {{"--over", "mass=1,2"}, {"--cases", "cases.csv"}, true}},
      {"--part", {{}, {"--part", "0/1"}, false}},
      {"--timeout", {{}, {"--timeout", "100"}, false}},
      {"--keep-failed", {{}, {"--keep-failed"}, false}},
      {"--collect", {{}, {"--collect"}, false}},
      {"--threads", {{}, {"--threads", "2"}, false}},
      {"--progress", {{}, {"--progress", "off"}, false}},
      {"--json", {{}, {"--json"}, false}}};
  // These run nothing, or name the table that rows are kept beside.
  const std::set<std::string> others{"--help", "--list", "--out"};
  write_text(folder.path() / "air.lua",
             "local sim = require 'sim'\nreturn { k = sim.arg('k', 0.1, 'kg/s') }\n");
  for (const std::string& option : options_of_sweep()) {
    INFO(option << ": say in this test whether rows depend on it");
    CHECK((trials.contains(option) || others.contains(option)));
  }
  int number = 0;
  for (const auto& [option, trial] : trials) {
    INFO(option);
    const auto words = [&](std::vector<std::string> more) {
      const bool named = !more.empty() && (more[0] == "--over" || more[0] == "--cases");
      if (!named) more = with({"--over", "mass=1,2"}, more);
      return with({"sweep", "fall.lua", "--out", std::to_string(number) + ".csv"}, more);
    };
    ++number;
    REQUIRE(kept(run_sim(words(trial.without), here)) == 0);
    CHECK(kept(run_sim(words(trial.with), here)) == (trial.changes_rows ? 0 : 2));
  }
}

TEST_CASE("a sweep refuses what it does not understand before it runs anything") {
  for (const auto& [words, why] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{}, "it is one of the two"},
           {{"--over", "stifness=1,2"}, "stiffness"},
           {{"--over", "dt=0.1,-1"}, "a number above 0"},
           {{"--over", "dt=0:1:log3"}, "factors need numbers above 0"},
           {{"--over", "dt=1:2:1"}, "N >= 2"},
           {{"--over", "seed=5..1"}, "LO <= HI"},
           {{"--over", "seed=1..9000000"}, "more than a million"},
           {{"--over", "dt=1,,2"}, "a value is missing"},
           {{"--over", "dt=1", "--over", "dt=2"}, "there twice"},
           {{"--over", "dt=1", "--part", "0/2"}, "kept beside a table"},
           {{"--over", "dt=1", "--part", "2/2", "--out", "a.csv"}, "out of range"},
           {{"--over", "dt=1", "--out", "a.png"}, "writes .csv"},
           {{"--over", "steps=1", "--over", "time=1"}, "only one of them"},
           {{"--cases", "/nowhere.csv"}, "No such file"}}) {
    const Outcome outcome = run_sim(with({"sweep", "scenes/pendulum1.lua"}, words));
    INFO(outcome.err);
    CHECK(outcome.code >= 2);
    CHECK(outcome.code <= 5);
    CHECK_THAT(outcome.err, Contains(why));
  }
  CHECK_THAT(run_sim({"sweep", "scenes/sample.lua", "--over", "dt=1"}).err, Contains("a world"));
  const Outcome list = run_sim({"sweep", "--over", "n=4:8:3", "--over", "seed=1..2", "--list"});
  CHECK(list.out == "case,n,seed\n0,4,1\n1,4,2\n2,6,1\n3,6,2\n4,8,1\n5,8,2\n");
}

TEST_CASE("a table is drawn, a curve for each value of a column") {
  const TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  std::ofstream(folder.path() / "t.csv") << "who,x,y\na,1,1\na,10,16\nb,1,2\nb,10,\nb,100,30\n";
  REQUIRE(run_sim({"plot", "t.csv", "-x", "x", "-y", "y", "--by", "who"}, here).code == 0);
  const std::string chart = read_text(folder.path() / "t.svg");
  CHECK_THAT(chart, Contains(">a<") && Contains(">b<") && Contains("t: y over x"));
  for (const auto& [words, why] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"plot", "t.csv", "-x", "x", "-y", "z"}, "unknown column"},
           {{"plot", "t.csv", "-x", "x", "-y", "who"}, "nothing to plot"},
           {{"plot", "t.csv", "-x", "x"}, "two columns"},
           {{"plot", "t.csv", "-x", "x", "-y", "y", "--out", "a.png"}, "a chart is .svg"},
           {{"plot", "u.csv", "-x", "x", "-y", "y"}, "No such file"}}) {
    const Outcome outcome = run_sim(words, here);
    CHECK(outcome.code >= 2);
    CHECK_THAT(outcome.err, Contains(why));
  }
}

}  // namespace sim_test
