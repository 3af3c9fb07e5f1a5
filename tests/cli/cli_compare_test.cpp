// sim compare: methods side by side, each with its error.
#include <catch2/catch.hpp>
#include <filesystem>
#include <sstream>

#include "tests/cli/json_check.h"
#include "tests/cli/program.h"
#include "tests/support/temporary.h"

namespace sim_test {
namespace {

// The pictures themselves are looked at in tests/picture; here what they are made of.
TEST_CASE("sim compare sets methods side by side, each with its own error") {
  const TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  const Outcome outcome = run_sim({"compare", "scenes/pendulum1.lua",
                                   "-T",      "1",
                                   "-i",      "rk4",
                                   "-i",      "verlet",
                                   "-i",      "rk4",
                                   "-d",      "0.01",
                                   "-d",      "0.01",
                                   "-d",      "0.005",
                                   "--json",  "--out",
                                   "c.npz",   "--out",
                                   "c.png",   "--size",
                                   "320x120"},
                                  here);
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
  const Json study = JsonReader(outcome.out).read();
  const auto& methods = study.at("methods").list;
  REQUIRE(methods.size() == 3);
  CHECK(study.at("frames").number == 31);
  CHECK(methods[0].at("steps").number == 100);
  CHECK(methods[2].at("steps").number == 200);
  // Whole steps alone, not what shortened ones took to be at the times of the frames.
  CHECK(methods[0].at("evaluations").number == 400);
  // The study tradeoff reports the same error by another path.
  const Outcome points = run_sim({"tradeoff", "scenes/pendulum1.lua", "-T", "1", "--integrators",
                                  "rk4", "--json", "--progress", "off"});
  const Json tradeoff = JsonReader(points.out).read();
  const double coarse = methods[0].at("error").number, fine = methods[2].at("error").number;
  CHECK(coarse / fine == Approx(16).epsilon(0.15));
  for (const Json& point : named(tradeoff.at("integrators"), "rk4").at("points").list) {
    if (!(point.at("error").number > 0)) continue;
    const double ratio = point.at("dt").number / 0.01;
    if (ratio > 0.1 && ratio < 2)
      CHECK(point.at("error").number / (ratio * ratio * ratio * ratio) ==
            Approx(coarse).epsilon(0.25));
  }
  CHECK(methods[1].at("error").number > 10 * coarse);
  CHECK(std::filesystem::exists(folder.path() / "c.png"));
}

// Panels of 640 x 540, of two methods in a row, of four in two.
TEST_CASE("pictures of sim compare are as large as their panels") {
  const TemporaryFolder folder;
  const std::pair<int, int> sizes[] = {{1280, 540}, {1280, 1080}};
  std::vector<std::string> arguments{"compare", "scenes/pendulum1.lua", "-T", "0.1", "--out",
                                     "c.png"};
  for (const auto& [width, height] : sizes) {
    arguments.insert(arguments.end(), {"-i", "rk4", "-i", "rk4"});
    const Outcome outcome = run_sim(arguments, {.folder = folder.path()});
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    const std::string png = read_text(folder.path() / "c.png");
    REQUIRE(png.size() > 24);
    const auto number = [&](std::size_t at) {  // of four bytes, the highest first
      int sum = 0;
      for (std::size_t k = 0; k < 4; ++k) sum = 256 * sum + static_cast<unsigned char>(png[at + k]);
      return sum;
    };
    CHECK(std::pair(number(16), number(20)) == std::pair(width, height));
  }
}

// One --dt for all methods, or one method with several.
TEST_CASE("sim compare gives each method its step") {
  const auto steps = [](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"compare", "scenes/pendulum1.lua", "-T", "0.2", "--json"});
    const Outcome outcome = run_sim(arguments);
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    std::vector<double> list;
    const Json answer = read_json(outcome.out);
    for (const Json& each : answer.at("methods").list)
      list.push_back(each.at("steps").number);
    return list;
  };
  using Steps = std::vector<double>;
  CHECK(steps({"-i", "rk4", "-i", "verlet", "-i", "rk3", "-d", "0.01"}) == Steps{20, 20, 20});
  CHECK(steps({"-i", "rk4", "-d", "0.01", "-d", "0.02"}) == Steps{20, 10});
  CHECK(steps({"-i", "rk4", "-i", "verlet", "-d", "0.02", "-d", "0.01"}) == Steps{10, 20});
}

TEST_CASE("sim compare judges by what the scene observes, too") {
  const auto compared = [](const std::string& of) {
    const Outcome outcome = run_sim({"compare", "scenes/pendulum.lua", "-T", "2", "--of", of, "-i",
                                     "rk4", "-i", "rk4", "-d", "0.02", "-d", "0.01", "--json"});
    REQUIRE(outcome.code == 0);
    return JsonReader(outcome.out).read();
  };
  for (const char* of : {"sag", "mean sag"}) {
    INFO(of);
    const Json study = compared(of);
    CHECK(study.at("judged").at("of").text == of);
    CHECK(study.at("judged").at("error").number < 1e-9);
    const auto& methods = study.at("methods").list;
    CHECK(methods[0].at("off").number > 10 * methods[1].at("off").number);
    CHECK(methods[1].at("off").number > 1e-9);
  }
  // A run reports the same figure.
  const Json mean = compared("mean sag");
  const Outcome run = run_sim(
      {"scenes/pendulum.lua", "-T", "2", "-i", "rk4", "-d", "0.01", "--of", "mean sag", "--json"});
  const Json report = JsonReader(run.out).read();
  CHECK(mean.at("methods").list[1].at("judged").number ==
        report.at("systems").list[0].at("observed").at("mean sag").at("value").number);
  const Outcome words = run_sim({"compare", "scenes/pendulum.lua", "-T", "2", "--of", "mean sag"});
  CHECK(words.out.find("judged      mean sag = ") != std::string::npos);
  CHECK(run_sim({"compare", "scenes/pendulum.lua", "--of", "sog"}).code == 2);
  CHECK(run_sim({"compare", "scenes/pendulum.lua", "-T", "1"}).out.find("off") ==
        std::string::npos);
}

TEST_CASE("sim compare says where a method is lost, and goes on with the others") {
  const Outcome outcome = run_sim({"compare", "scenes/cloth.lua", "-T", "1", "-i", "rk4", "-i",
                                   "euler", "-d", "0.005", "-d", "0.03", "--json"});
  REQUIRE(outcome.code == 0);
  const Json study = JsonReader(outcome.out).read();
  const auto& methods = study.at("methods").list;
  CHECK(methods[0].at("diverged_at").kind == Json::Kind::kNull);
  CHECK(methods[1].at("diverged_at").number > 0.1);
  CHECK(methods[1].at("diverged_at").number < 1);
  CHECK(methods[1].at("error").kind == Json::Kind::kNull);
}

// The cloth has a side of 0.875 m, and its size is about 1.2 m: no particle is shown further than
// half of that from where it should be.
TEST_CASE("a method that is lost stands where its panel still shows it") {
  const TemporaryFolder folder;
  const Outcome outcome =
      run_sim({"compare", "scenes/cloth.lua", "-i", "euler", "-i", "rk4", "--out", "c.csv"},
              {.folder = folder.path()});
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
  REQUIRE(outcome.out.find("diverged") != std::string::npos);
  std::istringstream rows(read_text(folder.path() / "c.csv"));
  std::string row;
  std::getline(rows, row);
  REQUIRE(row.starts_with("system,step,t,particle,x,y,z"));
  int seen = 0;
  while (std::getline(rows, row)) {
    if (!row.starts_with("euler")) continue;
    std::istringstream cells(row);
    std::string cell;
    double last_t = 0;
    for (int column = 0; column < 7 && std::getline(cells, cell, ','); ++column) {
      if (column == 2) last_t = std::stod(cell);
      if (column >= 4 && last_t > 1.5) CHECK(std::abs(std::stod(cell)) < 2);
    }
    ++seen;
  }
  CHECK(seen > 64 * 50);
}

TEST_CASE("sim compare refuses what it cannot show") {
  for (const auto& [words, why] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"compare", "scenes/sample.lua"}, "it is a world"},
           {{"compare", "-i", "rk4", "-i", "verlet", "-d", "1", "-d", "2", "-d", "3"},
            "steps without methods"},
           {{"compare", "--out", "a.xxx"}, "nothing writes .xxx"},
           {{"compare", "--steps", "3"}, "does not take it"},
           {{"-i", "rk4", "-i", "euler"}, "only one can hold"}}) {
    const Outcome outcome = run_sim(words);
    CHECK(outcome.code == 2);
    CHECK(outcome.err.find(why) != std::string::npos);
  }
}

}  // namespace
}  // namespace sim_test
