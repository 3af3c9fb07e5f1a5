// sim sweep and sim plot, as a user runs them.
#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
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
           {{"--cases", "/nowhere.csv"}, "no such file"}}) {
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
           {{"plot", "u.csv", "-x", "x", "-y", "y"}, "no such file"}}) {
    const Outcome outcome = run_sim(words, here);
    CHECK(outcome.code >= 2);
    CHECK_THAT(outcome.err, Contains(why));
  }
}

}  // namespace sim_test
