// Runs of random scenes that no closed form judges, and references for them.
#pragma once

#include <ctime>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/plugin/registry.h"
#include "core/scene/simulation.h"

namespace sim_test {

using State = std::vector<double>;

// The largest distance of a point; `width` numbers are one. Infinite for what is no number.
double distance(const State& a, const State& b, std::size_t width);
double root_mean_square(const State& a, const State& b);

// The system that the text of a scene describes, with values of its parameters.
sim::SystemSpec system_of(const std::string& text, sim::Registry& registry,
                          const std::map<std::string, std::string>& settings = {});

// Some methods refuse contact or constraints only when they meet them.
bool can_run(const sim::SystemSpec& spec, const std::string& method, sim::Registry& registry);

// Ends a case that takes too long, on a processor of its own or not.
class Patience {
 public:
  explicit Patience(double seconds = 5)
      : end_(std::clock() + static_cast<std::clock_t>(seconds * CLOCKS_PER_SEC)) {}
  bool over() const { return std::clock() > end_; }

 private:
  std::clock_t end_;
};

// A run seen at equal times: k time / (states.size() - 1), as far as it got.
struct SeenCourse {
  std::vector<State> states;
  bool finished = false;
  double seconds = 0;  // of the processor
  std::int64_t steps = 0, evaluations = 0;
};

struct CourseTask {
  double time = 0;  // s
  int frames = 20;  // after the start
  std::function<State(sim::Simulation&)> look;
  std::function<void(sim::Simulation&)> each_step = {};  // may be empty; the end too
};

// Steps are not shortened for the looks: each is at a short step of its own, which is taken back.
SeenCourse course_of(const sim::SystemSpec& spec, const sim::RunOptions& options,
                     const CourseTask& task, const Patience& patience, sim::Registry& registry);

// A motion at equal times as two methods of different families tell it, the two that agree best of
// an adaptive one and several of fixed steps.
struct Motion {
  std::vector<State> states;
  std::vector<double> unknown;  // at each, the rms of how far the two differ
  std::string how;
};

// Empty where no two get to the end in time.
std::optional<Motion> motion_of(const sim::SystemSpec& spec, const CourseTask& task,
                                const Patience& patience, sim::Registry& registry);

}  // namespace sim_test
