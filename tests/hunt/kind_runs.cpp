#include "tests/hunt/kind_runs.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/lua/scene/scene_file.h"
#include "core/study/problem.h"
#include "tests/support/scenes.h"

namespace sim_test {
namespace {

constexpr std::int64_t kOften = 32;  // steps between looks at the clock

// A method, and its steps for one of the scene's own.
struct Judge {
  const char* method;
  int finer;
  double tolerance;
};

constexpr Judge kAdaptive[] = {{"dop853", 1, 1e-12}, {"dopri5", 1, 1e-11}};
constexpr Judge kFixed[] = {{"rk4", 8, 0},
                            {"pefrl", 11, 0},
                            {"verlet", 48, 0},
                            {"rk3", 16, 0},
                            {"implicit_midpoint", 16, 0}};

}  // namespace

double distance(const State& a, const State& b, std::size_t width) {
  double most = 0;
  for (std::size_t i = 0; i < a.size(); i += width) {
    double square = 0;
    for (std::size_t k = i; k < i + width; ++k) square += (a[k] - b[k]) * (a[k] - b[k]);
    const double apart = std::sqrt(square);
    if (!(apart <= most)) most = apart;
  }
  return std::isnan(most) ? HUGE_VAL : most;
}

double root_mean_square(const State& a, const State& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return a.empty() ? 0 : std::sqrt(sum / static_cast<double>(a.size()));
}

sim::SystemSpec system_of(const std::string& text, sim::Registry& registry,
                          const std::map<std::string, std::string>& settings) {
  sim::SceneSpec scene = sim::load_scene(
      "hunted.lua", registry,
      {.search_path = {SIM_SOURCE_DIR "/scripts"}, .settings = settings, .text = text});
  return std::move(scene.systems.front());
}

bool can_run(const sim::SystemSpec& spec, const std::string& method, sim::Registry& registry) {
  try {
    const sim::Simulation system(spec, registry, {.integrator = method, .dt = spec.dt});
  } catch (const sim::Error&) {
    return false;
  }
  return true;
}

SeenCourse course_of(const sim::SystemSpec& spec, const sim::RunOptions& options,
                     const CourseTask& task, const Patience& patience, sim::Registry& registry) {
  sim::Simulation system(spec, registry, options);
  system.stop_when([&] { return patience.over(); });
  SeenCourse course;
  const std::clock_t begin = std::clock();
  const auto step = [&](std::int64_t most) {
    const int taken = patience.over() ? 0 : system.steps(task.each_step ? 1 : most);
    if (taken > 0 && task.each_step) task.each_step(system);
    return taken;
  };
  if (task.each_step) task.each_step(system);
  course.states.push_back(task.look(system));
  bool good = true;
  for (int k = 1; k <= task.frames && good; ++k) {
    const double t = task.time * k / task.frames;
    for (auto left = static_cast<std::int64_t>((t - system.t()) / system.h() + 1e-6);
         left > 0 && good;) {
      const int taken = step(std::min(left, kOften));
      left -= taken;
      good = taken > 0;
    }
    if (!good) break;
    const sim::Snapshot before = system.snapshot();
    const bool between = t - system.t() > 1e-6 * system.h();
    if (between) good = system.step_to(t);
    if (good && between && task.each_step && k == task.frames) task.each_step(system);
    if (good) course.states.push_back(task.look(system));
    if (between) system.restore(before);
  }
  course.finished = good;
  course.seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  course.steps = system.step_count();
  course.evaluations = sim::study::evaluations_of(system);
  return course;
}

std::optional<Motion> motion_of(const sim::SystemSpec& spec, const CourseTask& task,
                                const Patience& patience, sim::Registry& registry) {
  constexpr std::size_t kMostFixed = 3;
  struct Told {
    std::string method;
    bool adaptive;
    std::vector<State> states;
  };
  std::vector<Told> told;
  const auto try_one = [&](const Judge& judge) {
    sim::RunOptions options{.integrator = {judge.method}, .dt = spec.dt / judge.finer};
    if (judge.tolerance > 0) options.integrator.given["tol"] = judge.tolerance;
    try {
      SeenCourse seen = course_of(spec, options, task, patience, registry);
      if (seen.finished) told.push_back({judge.method, judge.tolerance > 0, seen.states});
    } catch (const sim::Error&) {  // it does not take this scene
    }
  };
  for (const Judge& judge : kAdaptive)
    if (told.empty()) try_one(judge);
  const std::size_t adaptive = told.size();
  for (const Judge& judge : kFixed)
    if (told.size() < adaptive + kMostFixed) try_one(judge);

  std::optional<Motion> best;
  double least = HUGE_VAL;
  for (std::size_t a = 0; a < told.size(); ++a)
    for (std::size_t b = a + 1; b < told.size(); ++b) {
      Motion motion{told[a].states, {}, told[a].method + " against " + told[b].method};
      double most = 0;
      for (std::size_t k = 0; k < motion.states.size(); ++k) {
        motion.unknown.push_back(root_mean_square(told[a].states[k], told[b].states[k]));
        if (!(motion.unknown.back() <= most)) most = motion.unknown.back();
      }
      if (!(most < least)) continue;
      least = most;
      best = std::move(motion);
    }
  return best;
}

}  // namespace sim_test
