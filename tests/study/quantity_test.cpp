// Figures of what a scene observes, against signals whose figures are known.
#include "core/study/quantity.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/base/error.h"
#include "core/study/accuracy/work_precision.h"
#include "tests/support/scenes.h"

using namespace sim_test;
using sim::study::Course;
using sim::study::Quantity;

namespace {

sim::SystemSpec observed() {
  sim::SystemSpec spec = make_circle();
  spec.observers = {{"x", [](const sim::Simulation& system) { return system.position(0)[0]; }},
                    {"y", [](const sim::Simulation& system) { return system.position(0)[1]; }}};
  return spec;
}

// The figure of a signal sampled at unequal times.
double figure(const std::string& text, const std::function<double(double)>& signal, double end,
              int looks) {
  const sim::SystemSpec spec = observed();
  Course course;
  for (int i = 0; i <= looks; ++i) {
    const double t = end * (i + (i % 3 == 1 && i < looks ? 0.2 : 0)) / looks;
    course.look(t, signal(t));
  }
  return course.figure(Quantity(spec, text));
}

double wave(double t) { return 3 + 2 * std::sin(2 * M_PI * t / 0.7 - 0.4); }

}  // namespace

TEST_CASE("figures of a course are those of the signal, to the order of what lies between") {
  const double mean =
      3 + 2 * 0.7 / (2 * M_PI * 10) * (std::cos(-0.4) - std::cos(2 * M_PI * 10 / 0.7 - 0.4));
  CHECK(figure("mean x", wave, 10, 1000) == Approx(mean).margin(2e-6));
  const double off = std::abs(figure("mean x", wave, 10, 500) - mean);
  CHECK(std::abs(figure("mean x", wave, 10, 1000) - mean) < off / 10);  // of order 4: 16
  CHECK(figure("max x", wave, 10, 1000) == Approx(5).margin(1e-4));
  CHECK(figure("min x", wave, 10, 1000) == Approx(1).margin(1e-4));
  CHECK(figure("period x", wave, 10, 1000) == Approx(0.7).epsilon(1e-7));
  // A ripple at the level makes no rises of its own.
  const auto rippled = [](double t) { return wave(t) + 0.05 * std::sin(200 * t); };
  CHECK(figure("period x", rippled, 10, 4000) == Approx(0.7).epsilon(2e-3));
}

// -cos(2 pi t) rises through any level once in each 1 s, the second time in the last interval or
// just behind it; one of the first looks has to be below the level.
TEST_CASE("a period is known from the look on at which it is complete") {
  const auto fall = [](double t) { return -std::cos(2 * M_PI * t); };
  // The mean until 1.24 s is -sin(2.48 pi) / 2.48 pi = -0.1281, which it passes at 1.2296 s.
  CHECK(figure("period x", fall, 1.24, 62) == Approx(1).epsilon(1e-5));
  CHECK(std::isnan(figure("period x", fall, 1.22, 61)));
  for (const double start : {0.0, 0.2})  // and at 0.24 s it is above it
    CHECK(figure(
              "period x", [&](double t) { return fall(t + start); }, 3, 300) ==
          Approx(1).epsilon(1e-5));
  // The largest of all looks, of which one is the first or the last, or beside them.
  for (const double top : {0.0, 0.05, 0.5, 0.95, 1.0}) {
    const auto arch = [&](double t) { return 2 - (t - top) * (t - top); };
    CHECK(figure("max x", arch, 1, 50) == Approx(2).margin(1e-12));
    CHECK(figure(
              "min x", [&](double t) { return -arch(t); }, 1, 50) == Approx(-2).margin(1e-12));
  }
}

// Speed of a ball that bounces at 0.63 s, and the height of its fall: a jump and a kink.
TEST_CASE("the largest and the least value of a course go beyond no jump and no kink") {
  const auto speed = [](double t) { return t < 0.63 ? -9.81 * t : 6.2 - 9.81 * (t - 0.63); };
  const auto height = [](double t) { return std::abs(t - 0.63); };
  for (const int looks : {50, 51, 52, 53, 500, 501}) {
    INFO(looks);
    const double step = 1.5 / looks;
    const double most = figure("max x", speed, 1.5, looks);
    CHECK(most <= 6.2);
    CHECK(most > 6.2 - 1.2 * 9.81 * step);
    const double least = figure("min x", speed, 1.5, looks);
    CHECK(least >= -9.81 * 0.63);
    CHECK(least < -9.81 * (0.63 - 1.2 * step));
    CHECK(figure("min x", height, 1.5, looks) >= 0);
    const auto ends_high = [&](double t) { return t > 1.5 - 1.5 * step ? 8 : t; };
    CHECK(figure("max x", ends_high, 1.5, looks) == 8);
  }
  // A smooth peak is still known to a higher order, whichever looks are next to it.
  for (const double shift : {0.0, 0.1, 0.2, 0.3, 0.4}) {
    const auto arch = [&](double t) { return std::cos(2 * M_PI * (t - 0.5 - 0.02 * shift)); };
    CHECK(figure("max x", arch, 1, 20) == Approx(1).margin(2e-3));  // the looks: 0.02
  }
}

TEST_CASE("late figures are those of the second half") {
  const auto step = [](double t) { return t < 5 ? 100 * t : wave(t); };
  CHECK(figure("mean x", step, 10, 2000) > 100);
  CHECK(figure("late mean x", step, 10, 2000) == Approx(3).margin(0.3));
  CHECK(figure("late max x", step, 10, 2000) == Approx(5).margin(1e-3));
  CHECK(figure("late period x", step, 10, 2000) == Approx(0.7).epsilon(1e-3));
}

TEST_CASE("a course of too few rises has no period, and one that is not finite no figure") {
  CHECK(std::isnan(figure(
      "period x", [](double t) { return t; }, 1, 100)));
  CHECK(std::isnan(figure(
      "period x", [](double) { return 2.0; }, 1, 100)));
  CHECK(std::isnan(figure(
      "mean x", [](double t) { return t > 0.5 ? NAN : 1; }, 1, 100)));
  CHECK(figure(
            "mean x", [](double) { return 7.0; }, 1, 2) == 7);
  CHECK(figure(
            "max x", [](double t) { return t; }, 1, 1) == 1);
}

TEST_CASE("a long course forgets every second look, and keeps its figures") {
  const sim::SystemSpec spec = observed();
  Course course;
  constexpr int kLooks = 3'000'001;
  for (int i = 0; i < kLooks; ++i) course.look(1e-3 * i, wave(1e-3 * i));
  CHECK(course.figure(Quantity(spec, "mean x")) == Approx(3).margin(1e-3));
  CHECK(course.figure(Quantity(spec, "period x")) == Approx(0.7).epsilon(1e-6));
  CHECK(course.figure(Quantity(spec, "x")) == wave(1e-3 * (kLooks - 1)));  // the last one
}

TEST_CASE("words that are no quantity are usage errors that name one") {
  const sim::SystemSpec spec = observed();
  for (const char* text :
       {"z", "mean z", "mean", "median x", "late x", "mean max x", "mean  x", ""})
    CHECK_THROWS_AS(Quantity(spec, text), sim::Error);
  try {
    Quantity(spec, "median x");
  } catch (const sim::Error& error) {
    CHECK(error.kind() == sim::ErrorKind::kUsage);
    CHECK(error.text().remedy.find("\"mean x\"") != std::string::npos);
  }
  CHECK(Quantity(spec, "y").observer() == 1);
  CHECK_FALSE(Quantity(spec, "y").is_figure());
}

// x of the circle is cos t: its mean to T is sin T / T, and its period 2 pi.
TEST_CASE("a study by a figure knows it, and the errors of methods by their order") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec spec = observed();
  sim::study::WorkPrecisionOptions options;
  options.time = 15;
  options.integrators = {{"rk4"}, {"trapezoid"}};
  options.budget = 1e-3;
  options.repeats = 0;
  const auto go_on = [](std::string_view, double) { return true; };
  for (const char* text : {"mean x", "period x"}) {
    INFO(text);
    sim::study::Problem problem{&spec, &registry};
    problem.of.emplace(spec, text);
    const auto study = sim::study::work_precision(problem, options, go_on);
    const bool mean = problem.of->text() == "mean x";
    const double truth = mean ? std::sin(15) / 15 : 2 * M_PI;
    CHECK(study->reference.figure == Approx(truth).epsilon(1e-9));
    CHECK(study->size == Approx(mean ? 2 : 2 * M_PI).epsilon(1e-3));
    REQUIRE(study->recommended);
    CHECK(study->at(*study->recommended).rms <= study->budget);
    for (const auto& curve : study->curves) {
      double finer = 0;
      for (auto point = curve.points.rbegin(); point != curve.points.rend(); ++point) {
        if (!point->finished) continue;
        CHECK(point->rms >= finer);  // none is right by chance
        CHECK(point->rms >= study->reference.error.front());
        finer = point->rms;
      }
    }
  }
}
