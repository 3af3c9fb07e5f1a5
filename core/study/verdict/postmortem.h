// The diagnosis of a diverged run: the spring that failed first, the forces on it, and a stable
// step.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/study/problem.h"
#include "core/study/verdict/strain.h"
#include "core/study/verdict/verdict.h"

namespace sim::study {

// A run that was really made, with its verdict.
struct Remedy {
  std::string integrator;  // empty: the same
  double dt = 0;           // s
  std::int64_t steps = 0;
  Verdict verdict;
};

struct PostMortem {
  std::string integrator;
  std::string choice;              // the integrator with its parameters, as --integrator takes it
  double dt = 0, limit_share = 0;  // dt as a share of the largest stable step at the start
  std::int64_t step = 0;           // the last one with a state that could be looked at

  // The spring that left its range first, at the end of `since`; empty if none did.
  std::optional<StrainedSpring> spring;
  std::string family;
  std::int64_t since = 0;
  double t = 0;       // s, of `since`
  double growth = 1;  // of its strain in each step from then on
  int particle = -1;  // the end of it that is lighter or moves faster
  std::vector<std::pair<std::string, double>> forces;  // N, on the particle then, largest first

  std::optional<Remedy> smaller, other;  // a smaller step; another integrator with the same step
  bool complete = true;                  // false when told to end, or when it took too long

  // True for a result that a user may use: verified, and in chaotic motion right for a while.
  static bool works(const Verdict& verdict) { return verdict.trust <= Trust::kChaotic; }
};

// Repeats the problem from its start, `steps` steps at most, until it fails again; then tries
// remedies over `time` s. At the step and with the integrator of the problem's options. It takes
// about `seconds`, wherever it is then, and is not complete if that was too short.
PostMortem post_mortem(const Problem& problem, std::int64_t steps, double time, double seconds,
                       const Watch& watch);

// A whole run with its refined run and verdict, as sim gives it; empty if told to end.
std::optional<Remedy> try_run(const Problem& problem, double dt, double time, const Watch& watch);

}  // namespace sim::study
