// Words of studies on a terminal, their plots and their output, without a clock.
#include "cli/run/study_progress.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <csignal>
#include <regex>
#include <sstream>

#include "cli/run/environment.h"
#include "cli/verbs/stability.h"
#include "core/report/stability_chart.h"
#include "core/study/limits/stability.h"
#include "tests/cli/program.h"
#include "tests/support/scenes.h"
#include "tests/support/temporary.h"

using namespace sim;
using namespace sim::cli;
using Catch::Contains;
using sim_test::TemporaryFolder;

namespace {

struct Streams {
  std::ostringstream out, err;
  Console console{out, err};
};

// The numbers of each match.
std::vector<std::vector<double>> numbers_of(const std::string& text, const std::string& pattern) {
  std::vector<std::vector<double>> found;
  const std::regex regex(pattern);
  for (std::sregex_iterator it(text.begin(), text.end(), regex), end; it != end; ++it) {
    std::vector<double>& row = found.emplace_back();
    for (std::size_t k = 1; k < it->size(); ++k) row.push_back(std::stod((*it)[k].str()));
  }
  return found;
}

study::MethodStability method(const std::string& name, std::optional<double> predicted,
                              std::optional<double> measured, bool adaptive = false,
                              bool chooses = false) {
  study::MethodStability one;
  one.method.label = name;
  one.method.info.adaptive = adaptive;
  one.method.chooses = chooses;
  one.predicted = predicted;
  one.measured = measured;
  return one;
}

}  // namespace

TEST_CASE("a bar shows the share that is done, and is cleared at the end") {
  for (const auto& [done, bar] : {std::pair(0.0, "[                              ]    0 %  rk4"),
                                  {0.5, "[###############               ]   50 %  rk4"},
                                  {0.039, "[#                             ]  3.9 %  rk4"},
                                  {1.0, "[##############################]  100 %  rk4"},
                                  {-3.0, "[                              ]    0 %  rk4"},
                                  {7.0, "[##############################]  100 %  rk4"}}) {
    Streams streams;
    {
      StudyProgress progress(ShowProgress::kOn, streams.console);
      const study::Watch watch = progress.watch();
      CHECK(watch("rk4", done));
      CHECK(streams.err.str() == "\r" + std::string(bar) + "\x1b[K");
      CHECK(progress.exit_code() == 0);
      CHECK_THAT(streams.err.str(), Catch::EndsWith("rk4\x1b[K\r\x1b[K"));
      streams.err.str("");
    }
    CHECK(streams.err.str().empty());  // once
  }
  // No bar where there is no terminal, or none is wanted.
  for (const ShowProgress when : {ShowProgress::kOff, ShowProgress::kAuto}) {
    Streams streams;
    StudyProgress progress(when, streams.console);
    CHECK(progress.watch()("rk4", 0.5));
    progress.clear();
    CHECK(streams.err.str().empty());
  }
  Streams terminal;
  terminal.console.err_is_terminal = true;
  StudyProgress progress(ShowProgress::kAuto, terminal.console);
  progress.watch()("rk4", 0.5);
  CHECK_THAT(terminal.err.str(), Contains("50 %"));
}

TEST_CASE("a study that will be long says so, and again where it takes twice as long as was said") {
  Streams streams;
  StudyProgress::Clock::time_point now{};
  StudyProgress progress(ShowProgress::kAuto, streams.console, [&] { return now; });
  const study::Watch watch = progress.watch();
  // The words when so much is done after so many seconds.
  const auto said = [&](double done, int seconds) {
    now = StudyProgress::Clock::time_point{} + std::chrono::seconds(seconds);
    streams.err.str("");
    CHECK(watch("rk4", done));
    return streams.err.str();
  };
  CHECK(said(0.05, 1).empty());  // too early to tell
  CHECK(said(0.5, 2).empty());   // 4 s
  CHECK_THAT(said(0.2, 3), Contains("rk4: 20 % done after 3 s, about 12 s more"));
  CHECK(said(0.2, 5).empty());  // 25 s, of 15
  CHECK_THAT(said(0.2, 7), Contains("rk4: 20 % done after 7 s, about 28 s more"));
  CHECK(said(0.99, 69).empty());
  CHECK_THAT(said(0, 70), Contains("rk4: 0 % done after 70 s; Ctrl-C"));  // nothing is known
}

TEST_CASE("a study of a second or more is announced") {
  const auto announced = [](double seconds, ShowProgress when) {
    Streams streams;
    StudyProgress(when, streams.console).announce(seconds);
    return streams.err.str();
  };
  CHECK(announced(0.99, ShowProgress::kAuto).empty());
  for (const double seconds : {1.0, 30.0}) {
    CHECK_THAT(announced(seconds, ShowProgress::kAuto),
               Contains("sim: note: the study takes about " + rough_time(seconds) +
                        "; Ctrl-C ends it with what it has\n"));
    CHECK(announced(seconds, ShowProgress::kOff).empty());
  }
}

TEST_CASE("a signal ends a study with what it has") {
  for (const int signal : {SIGINT, SIGTERM}) {
    Streams streams;
    StudyProgress progress(ShowProgress::kAuto, streams.console);
    const study::Watch watch = progress.watch();
    CHECK(watch("rk4", 0.1));
    CHECK(progress.caught() == 0);
    std::raise(signal);
    CHECK_FALSE(watch("rk4", 0.2));
    CHECK(progress.caught() == signal);
    CHECK(progress.exit_code() == 128 + signal);
    CHECK(streams.err.str() == "interrupted: this is what was measured until then\n");
    SessionSignals::clear();
  }
}

TEST_CASE("a plot is of one system, and no file that is read") {
  SceneSpec one, world;
  one.systems.emplace_back(sim_test::make_circle());
  world.systems = {sim_test::make_circle(), sim_test::make_circle()};
  FilePlan plan;
  plan_plot({}, world, plan);
  plan_plot("a.svg", one, plan);
  CHECK_NOTHROW(plan.check());
  CHECK_THROWS_WITH(plan_plot("a.svg", world, plan),
                    Contains("--svg a.svg") && Contains("the scene is a world"));
  plan_plot("a.svg", one, plan);  // a second time: two would write it
  CHECK_THROWS(plan.check());
}

TEST_CASE("texts of studies stand one below the other, JSON of a world in a list") {
  const auto put = [](const std::vector<std::string>& texts, bool json, bool world) {
    Streams streams;
    put_studies(texts, json, world, streams.console);
    CHECK(streams.err.str().empty());
    return streams.out.str();
  };
  CHECK(put({"a\n", "b\n"}, false, true) == "a\n\nb\n");
  CHECK(put({"a\n"}, false, false) == "a\n");
  CHECK(put({"{1}", "{2}"}, true, true) == "{\"systems\":[{1},{2}]}\n");
  CHECK(put({"{1}"}, true, true) == "{\"systems\":[{1}]}\n");
  CHECK(put({"{1}"}, true, false) == "{1}\n");
  CHECK(put({}, true, false).empty());
}

TEST_CASE("the verb writes its table or its JSON, and its plot beside it") {
  const TemporaryFolder folder;
  const std::filesystem::path scene = folder.path() / "scene.lua", plot = folder.path() / "s.svg";
  sim_test::write_text(scene,
                       "local sim = require 'sim'\n"
                       "local p = sim.particles { mass = 1 }\n"
                       "p:add { 0, 0, 0 }\np:add { 1, 0, 0 }\np:pin(0)\n"
                       "local s = sim.force.spring { stiffness = 25 }\ns:tie(0, 1)\n"
                       "return sim.scene { particles = p, forces = { s }, integrator = 'rk4',\n"
                       "  dt = 0.01, duration = 1 }\n");
  Registry registry = sim_test::make_registry();
  const Environment environment = find_environment({});
  const auto said = [&](bool json, bool svg) {
    Streams streams;
    StabilityRequest request;
    request.scene.scene = scene.string();
    request.integrators = {"verlet"};
    request.json = json;
    if (svg) request.svg = plot.string();
    request.progress = ShowProgress::kOn;
    CHECK(stability(request, environment, registry, streams.console) == 0);
    CHECK_THAT(streams.err.str(), Catch::EndsWith("\r\x1b[K"));
    return streams.out.str();
  };
  const std::string table = said(false, true), json = said(true, false);
  CHECK(table.starts_with("system "));
  CHECK_THAT(table, Contains("verlet") && Contains("0.4"));  // 2 / omega
  CHECK(json.starts_with("{\"system\":"));
  CHECK(json.find("\"systems\"") == json.npos);
  const std::string svg = sim_test::read_text(plot);
  CHECK(svg.starts_with("<svg "));
  CHECK(svg.ends_with("</svg>\n"));
  CHECK_THAT(svg, Contains(">verlet<") && Contains(">0.4 s<"));
}

// Bars end at the measured step, or at the predicted one where it is not known.
TEST_CASE("the plot of stable steps has a bar for each method without steps of its own") {
  study::Stability study;
  study.system = "cloth <8>";
  study.dt = 0.005;
  study.methods = {method("rk4", 0.05, 0.1),
                   method("verlet", 0.01, {}),
                   method("short", 0.001, 0.001),
                   method("dopri5", 0.5, 0.5, true),
                   method("auto", 0.5, 0.5, false, true),
                   method("unknown", {}, {}),
                   method("euler", 0.0, 0.0),
                   method("bdf2", HUGE_VAL, {})};
  const std::string svg = report::chart_of(study);
  CHECK_THAT(svg, Contains("Largest stable steps: cloth &lt;8&gt;"));
  CHECK_THAT(svg, Contains("largest stable step [s]; the line is the step of the scene, 0.005 s"));
  for (const char* name : {"dopri5", "auto", "unknown"}) CHECK(svg.find(name) == svg.npos);
  const auto bars = numbers_of(svg,
                               "<rect x=\"([^\"]*)\" y=\"([^\"]*)\" width=\"([^\"]*)\" "
                               "height=\"[^\"]*\" fill=\"#[0-9a-f]+\"");
  REQUIRE(bars.size() == 4);  // none of euler
  const double decade = bars[0][2] - bars[1][2];
  CHECK(bars[1][2] - bars[2][2] == Approx(decade).margin(0.02));
  const auto mark = numbers_of(svg, "<line x1=\"([^\"]*)\"[^>]*#111827");
  REQUIRE(mark.size() == 1);
  CHECK(mark[0][0] == Approx(bars[1][0] + bars[1][2] + decade * std::log10(0.5)).margin(0.02));
  CHECK(svg.find("#b91c1c") != svg.npos);  // the short one alone
  CHECK(svg.find("#b91c1c", svg.find("#b91c1c") + 1) == svg.npos);
  const std::pair<const char*, const char*> words[] = {{"rk4", "0.1 s"},
                                                       {"verlet", "0.01 s"},
                                                       {"short", "0.001 s"},
                                                       {"euler", "no step is stable"},
                                                       {"bdf2", "every step is stable"}};
  std::size_t at = 0;
  for (const auto& [name, text] : words) {  // in their order
    INFO(name);
    at = svg.find(">" + std::string(name) + "<", at);
    REQUIRE(at != svg.npos);
    CHECK(svg.find(">" + std::string(text) + "<", at) != svg.npos);
    CHECK(svg.find(">" + std::string(text) + "<", at) < at + 320);
  }
}
