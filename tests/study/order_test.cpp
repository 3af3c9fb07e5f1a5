// The order of convergence as it is observed.
#include "core/study/accuracy/order.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/support/scenes.h"

using namespace sim_test;

namespace {

sim::study::Watch no_watch() {
  return [](std::string_view, double) { return true; };
}

std::unique_ptr<sim::study::OrderStudy> study_of(
    const sim::SystemSpec& spec, double time, const std::vector<sim::MethodChoice>& choices = {}) {
  sim::Registry registry = make_registry();
  return sim::study::order({&spec, &registry}, {time, choices}, no_watch());
}

}  // namespace

TEST_CASE("methods keep their order on a circle with an exact solution") {
  sim::SystemSpec spec = make_circle();
  spec.exact = [](double t) { return std::vector<double>{std::cos(t), std::sin(t), 0}; };
  const auto study = study_of(spec, 1, {{"euler"}, {"trapezoid"}, {"rk4"}});
  CHECK(study->reference.how == "exact solution against extrapolation");
  for (const auto& each : study->methods) {
    INFO(each.method.name);
    CHECK(each.observed.value().slope == Approx(each.method.info.order).margin(0.1));
    CHECK(each.observed.value().points >= 3);
    CHECK(sim::study::keeps_order(each));
  }
}

TEST_CASE("methods keep their order against a reference, with drag too") {
  for (const double drag : {0.0, 0.5}) {
    const auto study = study_of(make_elastic_pendulum(drag), 1);
    CHECK(study->reference.how.find(" against ") != std::string::npos);
    CHECK(study->yardstick.floor() < 1e-9);
    for (const auto& each : study->methods) {
      INFO(each.method.name << " drag " << drag);
      CHECK(sim::study::keeps_order(each));
    }
  }
}

TEST_CASE("steps that a limit makes equal say nothing of an order") {
  const auto study = study_of(make_elastic_pendulum(), 1, {{"dopri5", {{"max_step", 1e-3}}}});
  const auto& observed = study->methods.front().observed;
  CHECK((!observed || observed->slope > 3.5));
}

TEST_CASE("steps are not halved below the rounding of single precision") {
  const auto study = study_of(make_cloth(8), 1, {{"rk4", {{"precision", std::string("single")}}}});
  const std::vector<sim::study::Point>& points = study->methods.front().points;
  CHECK(points.back().rms < 6e-7);  // 8 roundings of 1.2 m
  for (std::size_t i = 0; i + 1 < points.size(); ++i)
    CHECK((!points[i].finished || points[i].rms > 6e-7));
  // Not even an order that roundings make.
  const auto& observed = study->methods.front().observed;
  CHECK((!observed || observed->slope > 3.5));

  // Far away coordinates are rounded more.
  sim::SystemSpec far = make_cloth(8);
  far.particles->grid->origin.x() += 1000;
  const auto there = study_of(far, 0.2, {{"rk4", {{"precision", std::string("single")}}}});
  CHECK(there->methods.front().points.size() <= 3);
}

TEST_CASE("the order is fitted where local orders agree, and not where they do not") {
  sim::study::Reference reference;
  reference.error = {1e-14};
  sim::study::Yardstick yardstick{&reference, 1, 1, 0, false, 0};
  std::vector<sim::study::Point> points;
  const auto add = [&](double dt, double error) {
    sim::study::Point point;
    point.dt = dt;
    point.rms = error;
    point.finished = true;
    points.push_back(point);
  };
  for (const double dt : {0.1, 0.05, 0.025, 0.0125}) add(dt, 0.5 * dt * dt * dt);
  add(0.0125, 0.5 * std::pow(0.0125, 3));  // the same steps again
  const auto cubic = sim::study::observed_order(points, yardstick);
  CHECK(cubic.value().points == 4);
  CHECK(cubic.value().slope == Approx(3));
  CHECK(cubic.value().constant == Approx(0.5));
  points[1].rms *= 3;
  points[2].rms /= 3;
  CHECK_FALSE(sim::study::observed_order(points, yardstick).has_value());
  // The finer one of two rows that are as long: h^3 above, h^2 below.
  points.clear();
  for (const double dt : {0.1, 0.05, 0.025}) add(dt, 0.5 * dt * dt * dt);
  for (const double dt : {0.0125, 0.00625, 0.003125}) add(dt, 1e-4 * dt * dt);
  const auto finer = sim::study::observed_order(points, yardstick);
  CHECK(finer.value().points == 3);
  CHECK(finer.value().slope == Approx(2));
  CHECK(finer.value().constant == Approx(1e-4));
  points.clear();
  for (const double dt : {0.1, 0.05, 0.025, 0.0125}) add(dt, 1e-13);  // all below the floor
  CHECK_FALSE(sim::study::observed_order(points, yardstick).has_value());
}
