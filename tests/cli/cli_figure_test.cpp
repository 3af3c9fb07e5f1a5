// Figures of what a scene observes (--of "mean sag"), through the programs.
#include <catch2/catch.hpp>
#include <cmath>
#include <sstream>

#include "core/base/text.h"
#include "tests/cli/json_check.h"
#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

std::string lorenz(const TemporaryFolder& folder) {
  const std::string scene = (folder.path() / "lorenz.lua").string();
  write_text(scene,
             "local sim = require 'sim'\n"
             "return sim.scene { name = 'lorenz', state = { 1, 1, 20 },\n"
             "  field = sim.field.lua { function(t, x) return { 10 * (x[2] - x[1]),\n"
             "    x[1] * (28 - x[3]) - x[2], x[1] * x[2] - 8 / 3 * x[3] } end },\n"
             "  observe = { z = function(s) return s:component(2) end },\n"
             "  integrator = 'rk4', dt = 0.01, duration = 60 }\n");
  return scene;
}

}  // namespace

TEST_CASE("a figure of the whole run is judged by all studies that take quantities") {
  const auto json = [](std::vector<std::string> words) {
    words.emplace_back("--json");
    const Outcome outcome = run_sim(words);
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    return JsonReader(outcome.out).read();
  };
  const std::string scene = "scenes/pendulum.lua", of = "mean sag";
  const Json trade =
      json({"tradeoff", scene, "-T", "2", "--of", of, "--budget", "1%", "--integrators", "rk4"});
  const double mean = trade.at("figure").number;
  CHECK(mean < -0.5);
  CHECK(mean > -2);
  const Json& choice = trade.at("recommended");
  CHECK(choice.at("error").number <= trade.at("budget").number);

  // The command that it gives has that error, by the report of the run and by a sweep.
  const std::string dt = sim::shortest(choice.at("dt").number);
  const Json run = json({scene, "-T", "2", "-i", "rk4", "-d", dt, "--of", of, "--of", "max sag"});
  const Json& seen = run.at("systems").list.front().at("observed");
  CHECK(std::abs(seen.at(of).at("value").number - mean) <= 1.01 * choice.at("error").number);
  CHECK(seen.at(of).at("difference").number <= 2 * choice.at("error").number);
  CHECK(seen.at("max sag").at("value").number > mean + 0.1);
  const TemporaryFolder folder;
  const Outcome sweep = run_sim(
      {"sweep", scene, "--over", "dt=" + dt, "-T", "2", "-i", "rk4", "--of", of, "--out", "s.csv"},
      {.folder = folder.path()});
  REQUIRE(sweep.code == 0);
  const auto rows = lines_of(read_text(folder.path() / "s.csv"));
  const auto head = cells_of(rows[0]), row = cells_of(rows[1]);  // seconds come last
  REQUIRE(head[head.size() - 2] == of);
  CHECK(std::stod(row[row.size() - 2]) == seen.at(of).at("value").number);

  const Outcome none = run_sim({"tradeoff", scene, "--of", "period sag", "-T", "0.2"});
  CHECK(none.code == 2);
  CHECK(none.err.find("it rises through its mean less than twice") != std::string::npos);
  const Json order = json({"order", scene, "verlet", "-T", "1", "--of", of});
  CHECK(order.at("of").text == of);
  CHECK(order.at("integrators").list.front().at("observed").number == Approx(2).margin(0.2));
  const Json minimal = json({"minimal", scene, "-T", "1", "--of", of, "--budget", "5%"});
  for (const Json& part : minimal.at("parts").list)
    if (part.at("option").text == "--without gravity") CHECK(part.at("figure").number > 0.1);
}

// x = cos(w t) rises through its mean every 2 pi / w.
TEST_CASE("a period is a figure of the run where it has two rises, and words where not") {
  const TemporaryFolder folder;
  write_text(folder.path() / "turn.lua",
             "local sim = require 'sim'\n"
             "return sim.scene { name = 'turn', state = { 1, 0 }, integrator = 'rk4', dt = 0.01,\n"
             "  field = sim.field.formula { '-4*y', '4*x', names = { 'x', 'y' } },\n"
             "  observe = { x = function(s) return s:component(0) end }, duration = 10 }\n");
  const auto said = [&](const char* time) {
    const Outcome outcome =
        run_sim({"turn.lua", "-T", time, "--of", "period x"}, {.folder = folder.path()});
    CHECK(outcome.code == 0);
    return outcome.out + outcome.err;
  };
  const std::string words = said("9");
  INFO(words);
  const std::size_t at = words.find("period x = ");
  REQUIRE(at != std::string::npos);
  CHECK(std::stod(words.substr(at + 11)) == Approx(M_PI / 2).epsilon(1e-5));
  CHECK(words.find("less than twice") == std::string::npos);
  const std::string none = said("1.5");
  INFO(none);
  CHECK(none.find("period x: it rises through its mean less than twice") != std::string::npos);
  CHECK(none.find("period x = ") == std::string::npos);
}

TEST_CASE("of a chaotic scene a mean is known where positions are not") {
  const TemporaryFolder folder;
  const std::string scene = lorenz(folder);
  const auto study = [&](const std::string& of) {
    std::vector<std::string> words{"tradeoff", scene, "--integrators", "rk4",
                                   "--budget", "5",   "--json"};
    if (!of.empty()) words.insert(words.end(), {"--of", of});
    const Outcome outcome = run_sim(words);
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    return JsonReader(outcome.out).read();
  };
  CHECK(study("").at("comparable").number < 50);
  const Json mean = study("mean z");
  CHECK(mean.at("comparable").number == 60);
  CHECK(mean.at("figure").number == Approx(23.5).margin(1));  // of the attractor
  // The uncertainty of the figure exceeds rounding, and no claimed error is below it.
  const double known = mean.at("reference").at("error").number;
  CHECK(known > 1e-4);
  REQUIRE(mean.at("recommended").kind != Json::Kind::kNull);
  CHECK(mean.at("recommended").at("error").number >= known);
}

TEST_CASE("a chaotic run tells by its neighbours how well a figure is known") {
  const TemporaryFolder folder;
  const std::string scene = lorenz(folder);
  const auto observed = [](const std::vector<std::string>& words) {
    const Outcome run = run_sim(words);
    REQUIRE(run.code == 0);
    return JsonReader(run.out).read().at("systems").list.front().at("observed");
  };
  const Json chaotic = observed({scene, "--of", "mean z", "--json"});
  const Json& mean = chaotic.at("mean z");
  // A mean over 60 s is one of many; of the value at the end nothing is known at all.
  CHECK(mean.at("neighbours").number > 1e-3);
  CHECK(mean.at("neighbours").number < 2);
  CHECK(chaotic.at("z").at("neighbours").number > 1);
  const Outcome text = run_sim({scene, "--of", "mean z"});
  for (const char* part : {"z = ", "mean z = "}) {
    const auto at = text.out.find(part);
    REQUIRE(at != std::string::npos);
    CHECK(text.out.find("; chaotic, known to ", at) < text.out.find("half the step", at));
  }
  CHECK(text.out.find("neighbouring") != std::string::npos);

  // Before neighbours part there is nothing to ask them, and without a shadow nobody is asked.
  const Json regular = observed({scene, "-T", "2", "--of", "mean z", "--json"});
  CHECK(regular.at("mean z").at("neighbours").kind == Json::Kind::kNull);
  CHECK(regular.at("mean z").at("difference").number < 1e-4);
  CHECK(run_sim({scene, "-T", "2"}).out.find("chaotic") == std::string::npos);
  const Outcome unchecked = run_sim({scene, "--of", "mean z", "--no-verify"});
  CHECK(unchecked.out.find("half the step") == std::string::npos);
  const auto first = unchecked.out.find("; not verified");
  REQUIRE(first != std::string::npos);
  CHECK(unchecked.out.find("; not verified", first + 1) != std::string::npos);
}
