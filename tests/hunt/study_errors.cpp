// Claims of studies about errors, orders and costs.
#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/study/quantity.h"
#include "tests/hunt/studies.h"
#include "tests/support/scenes.h"

namespace sim_test {
namespace {

// An error that is told is at least that share of the true one.
constexpr double kShare = 2.0 / 3;
constexpr double kRounding = 1e-12;  // of the size
constexpr int kMethods = 3;          // of a study

double number(const Json& json) {
  return json.kind == Json::Kind::kNumber ? json.number : std::nan("");
}
double number(const Json& json, const char* key) {
  return json.has(key) ? number(json.at(key)) : std::nan("");
}
bool is_finite_point(const Json& point) {
  return point.has("status") ? point.at("status").text == "finite" : point.at("finished").flag;
}
bool is_object(const Json& json) { return json.kind == Json::Kind::kObject; }

const Json* point_of(const Json& methods, const Json& choice) {
  for (const Json& point : named(methods, choice.at("integrator").text).at("points").list)
    for (const char* key : {"dt", "tol"})
      if (choice.has(key) && number(choice.at(key)) > 0 &&
          number(choice.at(key)) == number(point, key))
        return &point;
  return nullptr;
}

}  // namespace

StudiedScene::PointCheck StudiedScene::check_point(const std::string& name, const Json& point,
                                                   double time, double until,
                                                   double reference_error, double size) {
  PointCheck check;
  const Motion* const truth = motion(time);
  const double tolerance = number(point, "tol"), dt = number(point, "dt");
  const double told = number(point, "error"), told_end = number(point, "error_end");
  const SeenCourse seen = run(options(name, dt, tolerance), time);
  check.seconds = seen.seconds;
  check.evaluations = seen.evaluations;
  if (!truth || !seen.finished) {
    ++tally().unknown;
    return check;
  }
  double least = 0, end = 0, end_unknown = 0;
  bool whole = false;
  for (std::size_t k = 0; k < seen.states.size(); ++k) {
    const double t = time * static_cast<double>(k) / static_cast<double>(seen.states.size() - 1);
    if (t > until * (1 + 1e-9)) break;
    end = root_mean_square(seen.states[k], truth->states[k]);
    end_unknown = truth->unknown[k];
    least = std::max(least, end - end_unknown);
    check.error = std::max(check.error, end);
    check.unknown = std::max(check.unknown, end_unknown);
    whole = k + 1 == seen.states.size();
  }
  check.known = check.unknown <= 0.25 * check.error;
  // Contact at other ends of steps has another error by chance.
  const bool by_chance = tolerance > 0 && text_.find("colliders =") != std::string::npos;
  const double share = by_chance ? 0.5 * kShare : kShare;
  const double slack = reference_error + kRounding * size;
  const std::string words =
      name +
      (tolerance > 0 ? ", tol " + sim::brief(tolerance, 3) : ", " + sim::brief(dt, 4) + " s") +
      ": told " + sim::brief(told, 3) + ", true " + sim::brief(check.error, 3) + " known to " +
      sim::brief(check.unknown, 2) + " (" + truth->how + ")";
  if (!check.known && !(told < share * least - slack))
    ++tally().unknown;
  else
    claim(!(told < share * least - slack), "error too small: " + words);
  if (whole && check.known && !(tolerance > 0) && !std::isnan(told_end))
    claim(std::abs(told_end - end) <= 0.1 * end + end_unknown + 10 * slack,
          "error at the end: told " + sim::brief(told_end, 3) + " of " + sim::brief(end, 3) + "; " +
              words);
  return check;
}

void StudiedScene::check_tradeoff() {
  const std::vector<std::string> names = some_methods(kMethods);
  const auto found = ask("tradeoff", {"--integrators", sim::join(names, ","), "--progress", "off"});
  if (!found) return;
  const double time = number(*found, "time"), size = number(*found, "size"),
               budget = number(*found, "budget"), until = number(*found, "comparable"),
               reference_error = number(found->at("reference"), "error");
  const Json& methods = found->at("integrators");
  struct Priced {
    std::string name;
    double cost, seconds, told;
  };
  std::vector<Priced> priced;
  const auto check = [&](const std::string& name, const Json& point) {
    const PointCheck seen = check_point(name, point, time, until, reference_error, size);
    priced.push_back({name, number(point, "cost"), seen.seconds, number(point, "seconds")});
    return seen;
  };
  for (const char* which : {"recommended", "cheapest"}) {
    if (!is_object(found->at(which))) continue;
    const Json& choice = found->at(which);
    const std::string name = choice.at("integrator").text;
    const Json* const point = point_of(methods, choice);
    claim(point != nullptr, std::string(which) + " is in no table");
    if (!point) continue;
    const PointCheck seen = check(name, *point);
    if (seen.known)
      claim(seen.error - seen.unknown <= 1.05 * budget,
            std::string(which) + ": " + name + " is off by " + sim::brief(seen.error, 3) +
                ", allowed " + sim::brief(budget, 3));
    const double told = number(choice, "evaluations");
    if (!(number(*point, "tol") > 0) && seen.evaluations > 0)
      claim(std::abs(told - static_cast<double>(seen.evaluations)) <= 0.05 * told + 8,
            std::string(which) + ": " + name + " takes " + std::to_string(seen.evaluations) +
                " evaluations, told " + sim::brief(told, 6));
  }
  if (is_object(found->at("cheapest")) && found->at("refused").list.empty()) {
    double least = HUGE_VAL;
    for (const Json& method : methods.list)
      for (const Json& point : method.at("points").list)
        if (is_finite_point(point) && number(point, "error") <= budget)
          least = std::min(least, number(point, "cost"));
    const Json* const point = point_of(methods, found->at("cheapest"));
    claim(point && number(*point, "cost") <= least, "another one within the budget is cheaper");
  }
  for (const Json& method : methods.list) {
    std::vector<const Json*> finite;
    for (const Json& point : method.at("points").list)
      if (is_finite_point(point)) finite.push_back(&point);
    for (int i = 0; i < 2 && !finite.empty(); ++i)
      check(method.at("name").text, *finite[static_cast<std::size_t>(
                                        random_.integer(0, static_cast<int>(finite.size()) - 1))]);
  }
  // Five times the cost takes longer, where that can be measured; costs of implicit methods are
  // times, which other programs lengthen.
  constexpr double kMore = 5, kMeasured = 5e-3, kBusy = 2;
  for (const Priced& dear : priced)
    for (const Priced& cheap : priced)
      if (dear.cost > kMore * cheap.cost && dear.seconds > kMeasured &&
          std::max(dear.told / dear.seconds, cheap.told / cheap.seconds) < kBusy)
        claim(cheap.seconds < 1.3 * dear.seconds,
              cheap.name + " costs " + sim::brief(cheap.cost, 4) + " and takes " +
                  sim::brief(cheap.seconds, 3) + " s, " + dear.name + " " +
                  sim::brief(dear.cost, 4) + " and " + sim::brief(dear.seconds, 3) + " s");
}

// The slope that is told lies among those from one true error to the next.
void StudiedScene::check_slope(const Json& method, double time, double reference_error,
                               double size) {
  const double told = number(method, "observed");
  std::vector<double> x, y;
  const double floor = 10 * reference_error;
  for (const Json& point : method.at("points").list) {
    const double error = number(point, "error");
    if (!is_finite_point(point) || !(error > 10 * floor) || !(error < 1e-2 * size)) continue;
    const PointCheck seen =
        check_point(method.at("name").text, point, time, time, reference_error, size);
    if (!seen.known || !(seen.unknown < 0.05 * seen.error)) continue;
    x.push_back(std::log(number(point, "dt")));
    y.push_back(std::log(seen.error));
  }
  if (std::isnan(told) || number(method.at("points").list.front(), "tol") > 0) return;
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (std::size_t i = 1; i < x.size(); ++i) {
    const double slope = (y[i] - y[i - 1]) / (x[i] - x[i - 1]);
    low = std::min(low, slope);
    high = std::max(high, slope);
  }
  if (x.size() < 3) {
    ++tally().unknown;
    return;
  }
  constexpr double kSlack = 0.3;
  claim(told > low - kSlack && told < high + kSlack,
        method.at("name").text + ": order " + sim::brief(told, 3) + ", between true errors " +
            sim::brief(low, 3) + " to " + sim::brief(high, 3));
}

void StudiedScene::check_order() {
  const std::vector<std::string> names = some_methods(kMethods);
  const auto found = ask("order", {"--integrators", sim::join(names, ","), "--progress", "off"});
  if (!found) return;
  for (const Json& method : found->at("integrators").list)
    if (!method.at("points").list.empty())
      check_slope(method, number(*found, "time"), number(found->at("reference"), "error"),
                  number(*found, "size"));
}

void StudiedScene::check_compare() {
  const std::vector<std::string> names = some_methods(2);
  std::vector<std::string> words{"--of", "mean seen", "--progress", "off"};
  for (const std::string& name : names) words.insert(words.end(), {"-i", name});
  const auto found = ask("compare", words);
  if (!found) return;
  const double time = number(*found, "time"), size = number(*found, "size");
  const double reference_error = number(found->at("reference"), "error");
  // The mean by the trapezoidal rule over the steps of two methods, one at least twice as fine.
  const sim::study::Quantity mean(spec_, "mean seen");
  std::vector<double> means;
  for (const auto& [method, finer] :
       {std::pair{"rk4", 20}, {"pefrl", 40}, {"rk3", 80}, {"verlet", 160}}) {
    if (means.size() == 2 || !std::ranges::count(methods_, method)) continue;
    double sum = 0, before = std::nan(""), t_before = 0;
    const CourseTask task{.time = time,
                          .frames = 1,
                          .look = [](sim::Simulation&) { return State{}; },
                          .each_step =
                              [&](sim::Simulation& system) {
                                const double value = mean.at(system), t = system.t();
                                if (!std::isnan(before))
                                  sum += (t - t_before) * (value + before) / 2;
                                before = value;
                                t_before = t;
                              }};
    const SeenCourse seen =
        course_of(spec_, options(method, time / std::ceil(time / spec_.dt * finer), 0), task,
                  Patience(), registry_);
    if (seen.finished) means.push_back(sum / t_before);
  }
  const bool known = means.size() == 2;
  const double truth = known ? means.back() : std::nan("");
  const double unknown = known ? std::abs(means.front() - means.back()) : HUGE_VAL;
  const Json& judged = found->at("judged");
  const double figure = number(judged, "figure"), error = number(judged, "error");
  if (std::isnan(figure) || !(unknown <= 1e-2 * std::abs(truth)))
    ++tally().unknown;
  else
    claim(std::abs(figure - truth) <= 1.5 * error + 3 * unknown + kRounding * std::abs(truth),
          "mean " + sim::brief(figure, 8) + " known to " + sim::brief(error, 2) + ", truth " +
              sim::brief(truth, 8) + " known to " + sim::brief(unknown, 2));
  for (const Json& method : found->at("methods").list) {
    if (!std::isnan(number(method, "diverged_at"))) continue;
    const std::string name = method.at("integrator").text;
    check_point(name, method, time, time, reference_error, size);
    sim::study::Course course;
    const CourseTask task{
        .time = time,
        .frames = 1,
        .look = [](sim::Simulation&) { return State{}; },
        .each_step = [&](sim::Simulation& system) { course.look(system.t(), mean.at(system)); }};
    const SeenCourse seen = course_of(spec_, {.integrator = {name}, .dt = number(method, "dt")},
                                      task, Patience(), registry_);
    const double off = std::abs(course.figure(mean) - truth), told = number(method, "off");
    if (!seen.finished || std::isnan(told) || !(unknown <= 0.1 * off)) {
      ++tally().unknown;
      continue;
    }
    claim(told >= kShare * off - 2 * error && told <= off / kShare + 2 * error,
          name + ": the mean is off by " + sim::brief(off, 3) + ", told " + sim::brief(told, 3));
  }
}

}  // namespace sim_test
