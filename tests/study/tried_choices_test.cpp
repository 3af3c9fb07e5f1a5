// Trials of choices: which are run, which are refused, and where the search ends.
#include "core/study/run/tried_choices.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "tests/support/scenes.h"

using namespace sim;
using namespace sim::study;

namespace {

// A spring pendulum of 6.3 rad/s: verlet is wrong at a tenth of a second, and right at 2 ms.
constexpr double kGood = 0.002;
constexpr double kTime = 2;  // s

struct Search {
  Registry registry = sim_test::make_registry();
  SystemSpec spec = sim_test::make_elastic_pendulum();
  Problem problem{&spec, &registry, {.integrator = "verlet", .dt = 0.05}};
  WorkPrecision study;

  // Points that all pretend to be within the budget, the longest step first and cheapest.
  Search(const std::string& method, const std::vector<double>& steps, bool tolerances = false) {
    study.budget = 0.01;
    study.time = kTime;
    study.reference.error = {0};
    study.yardstick.reference = &study.reference;
    sim::study::Curve& curve = study.curves.emplace_back();
    static_cast<MethodChoice&>(curve.method) = MethodChoice(method);
    curve.method.info = Method(registry, MethodChoice(method)).make()->info();
    for (std::size_t i = 0; i < steps.size(); ++i) {
      curve.points.push_back({.dt = tolerances ? 0 : steps[i],
                              .tolerance = tolerances ? steps[i] : 0,
                              .finished = true,
                              .rms = 1e-3,
                              .effort = {.evaluations = 1 << i}});
      curve.cost.push_back(1 << i);
    }
    recommend(study);
    REQUIRE((study.recommended && study.recommended->point == 0));
  }
  Tried run(const std::function<bool()>& stop = [] { return false; }) {
    return try_recommended(problem, study, kTime, stop);
  }
};

std::vector<double> long_steps(int count) {
  std::vector<double> steps;
  for (int i = 0; i < count; ++i) steps.push_back(0.14 - 0.003 * i);
  return steps;
}

}  // namespace

TEST_CASE("suspect choices are refused one after the other, up to one that holds") {
  std::vector<double> steps = long_steps(3);
  steps.push_back(kGood);
  steps.push_back(0.001);
  Search search("verlet", steps);
  const Tried tried = search.run();
  REQUIRE(tried.refused.size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(tried.refused[i].trust >= Trust::kSuspect);
    CHECK(search.study.refused[i].point == i);
  }
  CHECK(search.study.refused.size() == 3);
  REQUIRE((tried.recommended && search.study.recommended && search.study.cheapest));
  CHECK(tried.recommended->trust == Trust::kTrusted);
  CHECK(search.study.recommended->point == 3);
  CHECK(search.study.cheapest->point == 3);
  // The step of the point, not that of the scene: its share of the limit, 2 / omega.
  CHECK(tried.recommended->figures.dt_share < 0.05);
  CHECK(tried.refused[0].figures.dt_share > 20 * tried.recommended->figures.dt_share);
}

TEST_CASE("tolerances are tried as steps are") {
  Search search("dopri5", {0.9, 1e-9}, true);
  const Tried tried = search.run();
  REQUIRE(tried.refused.size() == 1);
  REQUIRE(tried.recommended);
  CHECK(tried.recommended->trust == Trust::kTrusted);
  CHECK(tried.recommended->figures.shadow.error < 1e-6);
  CHECK(search.study.recommended->point == 1);
}

TEST_CASE("twelve choices are tried and no more") {
  for (const int bad : {11, 12}) {
    INFO(bad);
    std::vector<double> steps = long_steps(bad);
    steps.push_back(kGood);
    Search search("verlet", steps);
    const Tried tried = search.run();
    CHECK(tried.refused.size() == static_cast<std::size_t>(bad));
    CHECK(search.study.refused.size() == static_cast<std::size_t>(bad));
    CHECK(tried.recommended.has_value() == (bad == 11));
    CHECK(search.study.recommended.has_value() == (bad == 11));
    CHECK(search.study.cheapest.has_value() == (bad == 11));
  }
  Search none("verlet", {0.14, 0.13});
  const Tried tried = none.run();
  CHECK(tried.refused.size() == 2);
  CHECK_FALSE((tried.recommended || none.study.recommended));
}

TEST_CASE("a trial that is stopped says nothing of its choice") {
  Search before("verlet", {0.14, kGood});
  Tried tried = before.run([] { return true; });
  CHECK((tried.refused.empty() && !tried.recommended && before.study.refused.empty()));
  CHECK(before.study.recommended->point == 0);
  int asked = 0;
  Search within("verlet", {0.14, kGood});
  tried = within.run([&] { return ++asked > 2; });
  CHECK(asked > 2);
  CHECK((tried.refused.empty() && !tried.recommended && within.study.refused.empty()));
  CHECK(within.study.recommended->point == 0);
}
