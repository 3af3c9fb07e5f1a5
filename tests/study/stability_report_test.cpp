// Rows of the table of stable steps: each figure just below and just above where its words change.
#include "core/report/stability_report.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <sstream>

using namespace sim;
using namespace sim::study;
using Catch::Contains;

namespace {

struct Row {
  std::optional<double> predicted = {}, measured = {}, radius = {};
  std::vector<double> errors = {};
  bool adaptive = false, chooses = false;
};

constexpr double kDt = 0.01;  // s

Stability study_of(const Row& row) {
  Stability study;
  study.system = "s";
  study.integrator = "rk4";
  study.dt = kDt;
  study.energy_time = 2;
  MethodStability& method = study.methods.emplace_back();
  method.method.label = "rk4";
  method.method.info.adaptive = row.adaptive;
  method.method.chooses = row.chooses;
  method.predicted = row.predicted;
  method.measured = row.measured;
  method.radius = row.radius;
  for (const double error : row.errors) method.energy.push_back({.error = error});
  return study;
}

// The words of the row after its name.
std::string cells(const Row& row) {
  std::istringstream lines(report::stability_text(study_of(row)));
  std::string line, words;
  while (std::getline(lines, line) && !line.starts_with("integrator")) continue;
  REQUIRE(std::getline(lines, line));
  std::istringstream in(line);
  in >> words;
  REQUIRE(words == "rk4");
  std::string all;
  while (in >> words) all += (all.empty() ? "" : " ") + words;
  return all;
}

}  // namespace

TEST_CASE("predicted and measured steps stand with how far they are off") {
  const auto off = [](double measured) { return cells({.predicted = 1, .measured = measured}); };
  CHECK(off(1.00049) == "1 1 0 % 1 %");
  CHECK(off(1.00051) == "1 1.001 0.1 % 1 %");
  CHECK(off(0.99949) == "1 0.9995 -0.1 % 1 %");
  CHECK(off(1.0949) == "1 1.095 9.5 % 0.91 %");
  CHECK(off(1.0996) == "1 1.1 10 % 0.91 %");
  CHECK(off(0.902) == "1 0.902 -9.8 % 1.1 %");
  CHECK(off(0.877) == "1 0.877 -12 % 1.1 %");
  CHECK(off(2.2) == "1 2.2 120 % 0.45 %");
  CHECK(off(0.0001) == "1 0.0001 -100 % 1e+04 %");
  CHECK(off(10.98) == "1 10.98 998 % 0.091 %");
  CHECK(off(11.01) == "1 11.01 x11 0.091 %");
  CHECK(off(25.37) == "1 25.37 x25 0.039 %");
  CHECK(off(125) == "1 125 x125 0.008 %");
  CHECK(off(2.5e7) == "1 2.5e+07 x2e+07 4e-08 %");
  CHECK(cells({.predicted = 0.5, .measured = 12}) == "0.5 12 x24 0.083 %");
  CHECK(cells({.predicted = 0.5, .measured = 0.6}) == "0.5 0.6 20 % 1.7 %");
  CHECK(cells({.predicted = 0, .measured = 0}) == "none none grows");
  CHECK(cells({.predicted = HUGE_VAL}) == "any - stable");
  CHECK(cells({.predicted = HUGE_VAL, .measured = HUGE_VAL}) == "any any stable");
  CHECK(cells({}) == "- - -");
}

TEST_CASE("a step stands by its share of the limit, or by its growth beyond it") {
  CHECK(cells({.predicted = 0.04}) == "0.04 - 25 %");
  CHECK(cells({.predicted = 0.04, .measured = 0.02}) == "0.04 0.02 -50 % 50 %");
  CHECK(cells({.predicted = 0.005, .radius = 1.0009}) == "0.005 - 200 %");
  CHECK(cells({.predicted = 0.005, .radius = 1.5}) == "0.005 - x1.5");
  CHECK(cells({.predicted = 0.005, .radius = HUGE_VAL}) == "0.005 - fails");
  // Inside the limit, and at it: what grows there is the system itself.
  CHECK(cells({.predicted = 0.0101, .radius = 1.5}) == "0.0101 - 99 %");
  CHECK(cells({.predicted = 0.01, .radius = 1.5}) == "0.01 - x1.5");
  CHECK(cells({.radius = 1.5}) == "- - x1.5");
  CHECK(cells({.predicted = 0.04, .adaptive = true}) == "0.04 - own steps");
  CHECK(cells({.predicted = 0.04, .chooses = true}) == "0.04 - own steps");
}

TEST_CASE("errors at shares of the limit stand in their columns, the first left out") {
  CHECK(cells({.predicted = 0.04, .errors = {9, 0.00123, 0.5, HUGE_VAL}}) ==
        "0.04 - 25 % 0.0012 0.5 fails");
  Stability study = study_of({.predicted = 0.04});
  CHECK_THAT(report::stability_text(study), Contains("energy error at share"));
  study.energy_time = 1e-3;
  CHECK_THAT(report::stability_text(study),
             Contains("     0.5     0.9     1.1\n") && Contains("of runs of 0.001 s, the largest"));
  study.energy_time = 0;
  CHECK(report::stability_text(study).find("error at share") == std::string::npos);
  CHECK(report::stability_text(study).find("0.9") == std::string::npos);
}

// lambda = -damping / 2 +- i sqrt(omega^2 - damping^2 / 4).
TEST_CASE("the fastest mode is said to vibrate, decay or grow") {
  const auto said = [](const Spectrum& spectrum) {
    Stability study = study_of({.predicted = 1});
    study.spectrum = spectrum;
    std::istringstream lines(report::stability_text(study));
    std::string all, line;
    while (std::getline(lines, line) && !line.starts_with("your run"))
      if (!line.starts_with("system"))
        all += (all.empty() ? "" : " ") +
               line.substr(std::min(line.size(), line.find_first_not_of(' ')));
    return all.substr(0, all.find("; residual"));
  };
  const auto second = [&](double omega, double damping, double decay = 0) {
    Spectrum spectrum;
    spectrum.fastest = {omega, damping};
    spectrum.decay = decay;
    return said(spectrum);
  };
  const auto first = [&](double omega, double damping) {
    Spectrum spectrum;
    spectrum.fastest = {omega, damping};
    spectrum.first_order = true;
    return said(spectrum);
  };
  const std::string begin = "fastest     ", period = begin + "20 rad/s (period 0.314 s), ";
  CHECK(second(0, 0) == begin + "nothing vibrates, decays or grows");
  CHECK(second(20, 0) == period + "damping 0 /s");
  CHECK(second(20, 3) == period + "damping 3 /s");
  CHECK(second(20, 3, 19) == period + "damping 3 /s");
  CHECK(second(20, 3, 21) == period + "damping 3 /s; fastest decay 21 1/s");
  CHECK(first(20, 40) == begin + "decay of 20 1/s");
  CHECK(first(20, -40) == begin + "growth of 20 1/s");
  CHECK(first(20, 38.1) == begin + "decay of 20 1/s");
  CHECK(first(20, 37.9) == period + "decaying at 18.9 1/s");
  CHECK(first(20, 6) == period + "decaying at 3 1/s");
  CHECK(first(20, -6) == period + "growing at 3 1/s");
  CHECK(first(20, 3.9e-5) == period + "neither growing nor decaying");
  CHECK(first(20, 4.1e-5) == period + "decaying at 2.05e-05 1/s");
}

TEST_CASE("bound, place and buckling are said where they are known") {
  Stability study = study_of({.predicted = 1});
  study.spectrum.fastest.omega = 20;
  study.spectrum.bound = HUGE_VAL;
  const auto text = [&] { return report::stability_text(study); };
  for (const char* const word : {"bound ", "where ", "buckling "})
    CHECK(text().find(word) == std::string::npos);
  study.spectrum.bound = 25;
  study.spectrum.particles = {{7, 0.5}, {3, 0.25}};
  CHECK_THAT(text(), Contains("bound       25 rad/s, from masses and stiffnesses alone\n"));
  CHECK_THAT(text(), Contains("where       mostly at particles 7 3\n"));
  study.spectrum.families = {{"shear", 0.75}, {"flex", 0.25}};
  CHECK_THAT(text(), Contains("mostly at particles 7 3; shear 75 %, flex 25 %\n"));
  study.spectrum.growth = 1.99e-3;
  CHECK(text().find("buckling") == std::string::npos);
  study.spectrum.growth = 2.01e-3;
  CHECK_THAT(text(), Contains("some direction grows at 0.00201 /s by itself"));
  study.spectrum.first_order = true;
  CHECK(text().find("buckling") == std::string::npos);
}

// Every figure of the table, and the limit by its name.
TEST_CASE("JSON of stable steps has every figure and names the limit") {
  const auto limit = [](const Row& row) {
    const std::string json = report::stability_json(study_of(row));
    const auto at = json.find("\"limit\":\"") + 9;
    return json.substr(at, json.find('"', at) - at);
  };
  CHECK(limit({.predicted = 0.04}) == "step");
  CHECK(limit({.predicted = 0}) == "none stable");
  CHECK(limit({.predicted = HUGE_VAL}) == "unlimited");
  CHECK(limit({}) == "unknown");
  CHECK(limit({.predicted = 0.04, .adaptive = true}) == "own steps");
  Stability study = study_of({.predicted = 0.04, .measured = 0.03, .radius = 1.5});
  study.methods[0].method.info.order = 4;
  study.methods[0].energy = {{.fraction = 0.9, .dt = 0.036, .error = 0.25}};
  study.methods[0].late = true;
  study.t = 0.5;
  study.complete = false;
  Spectrum& spectrum = study.spectrum;
  spectrum.fastest = {20, 3};
  spectrum.decay = 5, spectrum.growth = 0.125, spectrum.bound = 25, spectrum.residual = 0.0625;
  study.spectrum.particles = {{7, 0.5}};
  study.spectrum.families = {{"shear", 0.75}};
  CHECK(report::stability_json(study) ==
        R"({"system":"s","t":0.5,"omega_max":20,"damping":3,"residual":0.0625,)"
        R"("bound":25,"growth":0.125,"decay":5,"particles":[{"particle":7,"share":0.5}],)"
        R"("families":[{"family":"shear","share":0.75}],"integrator":"rk4","dt":0.01,)"
        R"("energy_time":2,"complete":false,"integrators":[{"name":"rk4","order":4,)"
        R"("predicted_dt":0.04,"measured_dt":0.03,"limit":"step","radius":1.5,)"
        R"("energy":[{"fraction":0.9,"dt":0.036,"error":0.25}],"late":true}]})");
}

// A mode that grows by r in each step of h grows e times in h / ln r.
TEST_CASE("a method without a stable step says how fast it is wrong") {
  const std::string text =
      report::stability_text(study_of({.predicted = 0, .radius = std::exp(0.5)}));
  CHECK_THAT(text, Contains("rk4 has no stable step here"));
  CHECK_THAT(text, Contains("at 0.01 s the fastest mode grows e times every 0.02 s"));
  CHECK(report::stability_text(study_of({.predicted = 0, .radius = 1})).find("e times") ==
        std::string::npos);
  CHECK(report::stability_text(study_of({.predicted = 0.1, .radius = 2})).find("no stable") ==
        std::string::npos);
  Stability late = study_of({.predicted = 0.1});
  CHECK(report::stability_text(late).find("Not all runs") == std::string::npos);
  late.methods[0].late = true;
  CHECK_THAT(report::stability_text(late), Contains("Not all runs were made of rk4"));
}
