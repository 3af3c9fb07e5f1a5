// Tables and charts of the measurements of first-order systems.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/output/svg.h"
#include "tests/bench/field_peers.h"

namespace sim_bench {
namespace {

constexpr int kFirstLevel = 3, kLastLevel = 9;  // errors 1e-3 .. 1e-9
constexpr double kWellKnown = 0.1;              // of an error, what the reference may be off

struct Best {
  double seconds = std::numeric_limits<double>::infinity();
  const FieldCurve* curve = nullptr;
};

// Ours at the last state alone, peers, auto, and ours for as many states as auto.
enum class Of { kOurs, kPeers, kAuto, kBesideAuto };

bool is_of(const FieldCurve& curve, Of of) {
  if (!curve.ours()) return of == Of::kPeers;
  if (curve.method == "auto") return of == Of::kAuto;
  return of == (curve.states == 1 ? Of::kOurs : Of::kBesideAuto);
}

Best best_of(const FieldProblem& problem, double error, Of of) {
  Best best;
  for (const FieldCurve& curve : problem.curves) {
    if (!is_of(curve, of)) continue;
    if (const double seconds = seconds_to(curve, error); seconds < best.seconds)
      best = {seconds, &curve};
  }
  return best;
}

std::string power_of_ten(int exponent) { return "1e-" + std::to_string(exponent); }

}  // namespace

Table field_ratio_table(const FieldReport& report) {
  std::vector<Column> columns{{"problem", "problem", false}, {"unknowns", "unknowns"}};
  for (int level = kFirstLevel; level <= kLastLevel; ++level)
    columns.push_back({power_of_ten(level), "ratio_" + power_of_ten(level)});
  columns.push_back({"worst", "worst"});
  columns.push_back({"ours", "ours", false});
  columns.push_back({"ms", "ms_of_ours"});
  columns.push_back({"peer", "peer", false});
  columns.push_back({"ms", "ms_of_peer"});
  columns.push_back({"auto", "auto_over_best"});
  Table table("fields", "Time to accuracy of first-order systems over that of the best peer",
              columns);
  double sum = 0, worst = 0, worst_auto = 0;
  int count = 0;
  for (const FieldProblem& problem : report.problems) {
    std::vector<std::string> cells{problem.name, std::to_string(problem.size)};
    double most = 0, most_auto = 0;
    Best our_worst, peer_worst;
    for (int level = kFirstLevel; level <= kLastLevel; ++level) {
      const double error = std::pow(10.0, -level);
      const Best ours = best_of(problem, error, Of::kOurs);
      const Best peer = best_of(problem, error, Of::kPeers);
      const Best own_choice = best_of(problem, error, Of::kAuto);
      cells.emplace_back();
      if (!(problem.known <= kWellKnown * error)) continue;
      const Best beside = best_of(problem, error, Of::kBesideAuto);
      if (std::isfinite(own_choice.seconds))
        most_auto = std::max(most_auto, own_choice.seconds / beside.seconds);
      if (!ours.curve || !peer.curve) continue;
      const double ratio = ours.seconds / peer.seconds;
      cells.back() = short_number(ratio);
      sum += std::log(ratio);
      ++count;
      if (ratio > most) {
        most = ratio;
        our_worst = ours;
        peer_worst = peer;
      }
    }
    worst = std::max(worst, most);
    worst_auto = std::max(worst_auto, most_auto);
    cells.push_back(most > 0 ? short_number(most) : "");
    for (const Best& best : {our_worst, peer_worst}) {
      cells.push_back(best.curve ? best.curve->name() : "");
      cells.push_back(best.curve ? short_number(1e3 * best.seconds) : "");
    }
    cells.push_back(most_auto > 0 ? short_number(most_auto) : "");
    table.add(cells);
  }
  if (report.problems.empty()) return table;
  if (count > 0)
    table.note("worst ratio " + short_number(worst) + " (asked: 2), geometric mean " +
               short_number(std::exp(sum / count)) + " (asked: below 1), auto over our best " +
               short_number(worst_auto) + " (asked: 3).");
  table.note(
      "The largest error of a number at the end, over floor + |x|, where tolerances are rtol "
      "(floor "
      "+ |x|) too: processor time of the best method of ours over that of the best peer, on lines "
      "between tolerances two a decade. No figure: one of them does not come there, or the "
      "reference, which is the result that another method confirms best, is not known that well. "
      "ours, peer: at the worst ratio. auto: over our best method, at worst, both asked for a "
      "hundred states.");
  table.note("Peers: " + sim::join(report.programs, "; ") +
             "; the first of Debian is compiled without optimization.");
  return table;
}

Table field_front_table(const FieldReport& report) {
  Table table("fields_front", "The fronts: what no other run beats in both error and time",
              {{"problem", "problem", false},
               {"program", "program", false},
               {"method", "method", false},
               {"rtol", "rtol"},
               {"error", "error"},
               {"ms", "ms"},
               {"evaluations", "evaluations"}});
  for (const FieldProblem& problem : report.problems)
    for (const bool ours : {true, false}) {
      std::vector<std::pair<const FieldCurve*, const FieldPoint*>> points;
      for (const FieldCurve& curve : problem.curves)
        if (is_of(curve, ours ? Of::kOurs : Of::kPeers))
          for (const FieldPoint& point : curve.points) points.emplace_back(&curve, &point);
      std::ranges::sort(points, {}, [](const auto& entry) { return entry.second->seconds; });
      double least = 1;  // of what is called an error at all
      for (const auto& [curve, point] : points) {
        if (!(point->error < least)) continue;
        least = point->error;
        table.add({problem.name, curve->program, curve->method, sim::brief(point->rtol, 2),
                   sim::brief(point->error, 2), short_number(1e3 * point->seconds),
                   std::to_string(point->evaluations)});
      }
    }
  return table;
}

Table field_speed_table(const FieldReport& report) {
  Table table("fields_speed", "First-order systems at one step or one tolerance",
              {{"what", "what", false},
               {"ours", "ours"},
               {"peer", "peer"},
               {"unit", "unit", false},
               {"ratio", "ratio"},
               {"asked", "asked", false}});
  for (const FieldSpeed& speed : report.speeds) {
    const bool compared = speed.peer > 0 && std::isfinite(speed.peer);
    table.add({speed.what, short_number(speed.ours), compared ? short_number(speed.peer) : "",
               speed.unit, compared ? short_number(speed.ours / speed.peer) : "", speed.asked});
  }
  return table;
}

void write_field_charts(const FieldReport& report, const std::string& folder) {
  std::filesystem::create_directories(folder);
  for (const FieldProblem& problem : report.problems) {
    sim::Chart chart{.title = problem.name + ": error against time",
                     .subtitle = std::to_string(problem.size) +
                                 " unknowns; in colour sim, in grey SUNDIALS and odeint, one core",
                     .x_name = "processor time, ms",
                     .y_name = "largest error at the end",
                     .curves = {},
                     .lines = {},
                     .ring = {}};
    for (const FieldCurve& curve : problem.curves) {
      if (is_of(curve, Of::kBesideAuto)) continue;
      sim::ChartCurve drawn{.name = curve.name(), .points = {}, .strong = curve.ours()};
      drawn.dashed = curve.method == "auto";
      for (const FieldPoint& point : curve.points)
        if (point.error < 1) drawn.points.emplace_back(1e3 * point.seconds, point.error);
      if (!drawn.points.empty()) chart.curves.push_back(std::move(drawn));
    }
    const std::string path = (std::filesystem::path(folder) / (problem.name + ".svg")).string();
    std::ofstream out(path);
    out << sim::svg(chart);
    out.close();
    if (!out)
      throw sim::Error(sim::ErrorKind::kIo, {"cannot write a chart", path, "", "another folder"});
  }
}

}  // namespace sim_bench
