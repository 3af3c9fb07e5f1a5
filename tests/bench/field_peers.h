// First-order systems in other programs: time to accuracy, in turns with ours.
#pragma once

#include <string>
#include <vector>

#include "core/plugin/registry.h"
#include "tests/bench/options.h"
#include "tests/bench/table.h"

namespace sim_bench {

// A run to a tolerance.
struct FieldPoint {
  double rtol = 0;
  double error = 0;    // the largest |x_i - reference_i| / (floor + |reference_i|) at the end
  double seconds = 0;  // of processor time, the least of all turns
  long evaluations = 0;
};

// A method of a program on a problem, from loose tolerances to tight ones.
struct FieldCurve {
  std::string program, method;
  std::vector<FieldPoint> points;
  int states = 1;  // asked for on the way
  bool ours() const { return program == "sim"; }
  std::string name() const { return ours() ? method : program + " " + method; }
};

struct FieldProblem {
  std::string name;
  int size = 0;
  double known = 0;  // to which error the reference is known
  std::vector<FieldCurve> curves;
};

// The time that a curve takes to an error, on straight lines between its points on axes of decades;
// infinity where it does not reach it.
double seconds_to(const FieldCurve& curve, double error);

// Steps of the classical Runge-Kutta method, and one system in two languages.
struct FieldSpeed {
  std::string what, unit;
  double ours = 0, peer = 0;
  std::string asked;
};

struct FieldReport {
  std::vector<FieldProblem> problems;
  std::vector<FieldSpeed> speeds;
  std::vector<std::string> programs;  // and their versions
};

// Adds to notes what is missing and how to get it.
FieldReport measure_fields(const Options& options, sim::Registry& registry,
                           std::vector<std::string>& notes);

Table field_ratio_table(const FieldReport& report);
Table field_front_table(const FieldReport& report);
Table field_speed_table(const FieldReport& report);
// A chart of each problem, NAME.svg in that folder.
void write_field_charts(const FieldReport& report, const std::string& folder);

}  // namespace sim_bench
