#include "core/study/accuracy/checked_run.h"

#include <algorithm>

#include "core/study/accuracy/trial_pair.h"

namespace sim::study {

bool CheckedRun::see(const TrialRun& plan, const RunWatch& go_on, const RunChange& change,
                     SeenRun& to) {
  bool ended = false;
  const RunWatch watch = [&](double part) { return !(ended = ended || !go_on(part)); };
  to = seen_run(problem_, method_, plan, time_, watch, change);
  cost_ += to.cost;
  spent_ += to.cost;
  return !ended;
}

double CheckedRun::kept_until(const ErrorCourse& course, double allowed) const {
  const double share = kept_share(course.rms, allowed);
  return share < 1 ? share * time_ : HUGE_VAL;
}

void CheckedRun::worsen(const ErrorCourse& course, double times, double allowed) {
  error_ = std::max(error_, times * course.most);
  largest_ = std::max(largest_, times * course.largest);
  horizon_ = std::min(horizon_, kept_until(course, allowed));
}

// The distance of the two is 1 - falls of the error.
void CheckedRun::compare(double falls) {
  worsen(error_course(problem_, run_, fine_), 1 / (1 - falls), allowed_ * (1 - falls));
}

bool CheckedRun::contradicts(const SeenRun& other, double error) const {
  return error_course(problem_, run_, other).most > kFamiliesAgree * (allowed_ + error);
}

void CheckedRun::believe(const SeenRun& other, double error) {
  worsen(error_course(problem_, run_, other), 1, kFamiliesAgree * (allowed_ + error));
}

// Half a step sooner or later is half of what an event may be late by.
bool CheckedRun::run_between(const RunWatch& go_on) {
  SeenRun between;
  if (!see(plan_, go_on, {.shifted = true}, between)) return false;
  worsen(error_course(problem_, run_, between), 2, allowed_ / 2);
  return true;
}

bool CheckedRun::is_chaotic(bool corrected, double size, const RunWatch& go_on) {
  constexpr double kAway = 1e-8, kChaos = 1e5;
  if (!fine_.finished) return false;
  SeenRun neighbour;
  if (!see(refined(plan_, corrected), go_on, {.disturbed = kAway * size}, neighbour)) return false;
  return error_course(problem_, fine_, neighbour).most > kChaos * kAway * size;
}

}  // namespace sim::study
