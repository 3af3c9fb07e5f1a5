#include "core/study/accuracy/error_goal.h"

#include <algorithm>
#include <ctime>
#include <numeric>
#include <tuple>

#include "core/base/text.h"
#include "core/math/elementary.h"
#include "core/study/accuracy/checked_run.h"
#include "core/study/accuracy/goal_trials.h"
#include "core/study/accuracy/mending.h"
#include "core/study/accuracy/required_error.h"
#include "core/study/accuracy/trial_pair.h"

namespace sim::study {
namespace {

constexpr double kTrialParticles = 64;  // costs are of systems of so many, or fewer
constexpr double kTrialCost = 1e5;      // evaluations of the run up to which all of it is tried
constexpr double kFree = 1e6;           // that all trials may take, however short the run,
constexpr double kOfOne = 0.25;         // of that, at most, counts what one method took
constexpr double kFreeChecks = 1e5;     // that checks of the choice may take where trials took all
constexpr double kFreeSeconds = 10;     // of one core, as some evaluations take far longer
constexpr double kShortest = 1.0 / 64;  // of the run, that is tried
constexpr double kCheckCost = 4;        // times that of the choice may take its check
constexpr double kMeaningful = 0.1;  // of the size: an error above it tells nothing of finer runs
constexpr int kMostMendings = 4;

class Chooser {
 public:
  Chooser(const Problem& problem, const ErrorGoal& goal, const Watch& watch);

  GoalChoice choose();

 private:
  // `part` of a run of this cost is done, and `later` follows it.
  bool go_on(const std::string& what, double part, double cost, double later);
  double window_of(Simulation& system) const;
  void measure_range();
  bool affordable(const MethodTrials& next) const;
  bool affordable_check(const MethodTrials& next) const;
  double spent() const;
  double least_known() const;  // the cost of the run, as far as trials tell
  double done() const { return spent() + runs_cost_; }                           // evaluations
  double rate() const { return done() > 0 ? (seconds() - lost_) / done() : 0; }  // s of one
  // Evaluations that would have taken as long as the trials that were given up.
  double given_up() const { return lost_ > 0 && rate() > 0 ? lost_ / rate() : 0; }
  double free_seconds() const;
  bool cheaper_than_run(const MethodTrials& next) const;  // with all trials before
  double seconds() const { return static_cast<double>(std::clock() - begin_) / CLOCKS_PER_SEC; }
  bool refine(MethodTrials& method);
  void race();
  MethodTrials* cheapest();
  MethodTrials* check_for(const MethodTrials& chosen);
  TrialPair pair(const MethodTrials& a, const MethodTrials& b) const { return {problem_, a, b}; }
  bool agrees(MethodTrials& chosen, MethodTrials& check);  // else one of them is refined
  // True if steps may be longer than a pulse, whatever the tolerance.
  bool may_miss_pulse(const MethodTrials& each) const {
    return goal_trials_.pulse() < HUGE_VAL && Refinement(each.method()).by_tolerance();
  }
  bool sees_more(const MethodTrials& check, const MethodTrials& chosen) const {
    return may_miss_pulse(chosen) && !may_miss_pulse(check);
  }
  MethodTrials* choose_checked();
  double predicted_fineness(const MethodTrials& chosen) const;
  double own_fineness(const MethodTrials& own) const;
  bool is_far_dearer_than_own(double cost);
  struct Beginning {
    double fineness;
    int most_mendings;
    double most_cost = HUGE_VAL;  // of a run, evaluations
    bool from_scene = false;
  };
  // True if the goal asks for its steps.
  bool is_fixed(const Candidate& method) const {
    return goal_.dt > 0 && !Refinement(method).by_tolerance();
  }
  void run_whole(MethodTrials& chosen, const Beginning& beginning);
  bool check(const MethodTrials& chosen, double cost, double falls, CheckedRun& checked);
  bool check_between(CheckedRun& checked);
  void hear_others(const MethodTrials& chosen, CheckedRun& checked);
  bool is_chaotic(CheckedRun& checked);
  void keep(CheckedRun&& checked, bool from_scene);
  void tell_best();
  std::string own_name() const {
    return problem_.registry->get<Integrator>(problem_.integrator().name).name;
  }
  MethodTrials& own();
  void tell_candidates();

  double ahead() const;  // the cost of the run and its refined run, as far as trials tell
  double in_window() const { return result_.allowed * result_.window / result_.time; }
  double whole(double cost) const { return cost * result_.time / result_.window; }
  double predicted_cost(const MethodTrials& each) const {  // of the run, evaluations
    return whole(each.predict(kAim * in_window()).cost);
  }
  double longer_than_window(const MethodTrials& each) const {  // in terms of its fineness
    return Refinement(each.method()).by_tolerance() ? 1 : result_.time / result_.window;
  }

  const Problem& problem_;
  const ErrorGoal& goal_;
  const Watch& watch_;
  GoalTrials goal_trials_;
  double weight_ = 1;        // evaluations of 64 particles that one takes
  std::clock_t begin_ = 0;   // of the trials
  double checks_ = 0;        // evaluations that checks took
  double lost_ = 0;          // s, of trials that were given up
  double runs_cost_ = 0;     // of the runs that are done, evaluations
  double chaotic_from_ = 0;  // s, the horizon of a run that has shown chaos
  bool told_ = false;
  std::vector<MethodTrials> trials_;
  std::optional<CheckedRun> best_;
  GoalChoice result_;
};

Chooser::Chooser(const Problem& problem, const ErrorGoal& goal, const Watch& watch)
    : problem_(problem), goal_(goal), watch_(watch), goal_trials_(problem, goal) {
  Simulation system = problem.simulation();
  result_.system = system.name();
  result_.unit = problem.of || system.flat() ? "" : "m";
  result_.time = goal.time;
  result_.asked = goal.asked;
  result_.size = scene_size(system);
  result_.allowed = goal.budget.of(result_.size);
  weight_ = std::max(1.0, std::max(system.particles(), system.components() / 3) / kTrialParticles);
  result_.window = window_of(system);
}

bool Chooser::go_on(const std::string& what, double part, double cost, double later) {
  const double before = done() + given_up(), all = before + cost + later;
  told_ = told_ || !watch_(what, all < HUGE_VAL ? (before + part * cost) / all : 0);
  return !told_;
}

// The whole run if it is cheap, or a part that is.
double Chooser::window_of(Simulation& system) const {
  const double steps = result_.time / system.h();
  const double cost = weight_ * steps * std::max(1, system.integrator_info().evaluations);
  double share = 1;
  while (cost * share > kTrialCost && share > kShortest) share /= 2;
  return share * result_.time;
}

// The range of a quantity is known once something has run.
void Chooser::measure_range() {
  if (!problem_.of) return;
  const MethodTrials* best = nullptr;
  for (const MethodTrials& each : trials_)
    if (each.finest().finished && (!best || each.error() < best->error())) best = &each;
  if (!best) return;
  double range = std::abs(best->finest().figure);
  if (!problem_.by_figure()) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (const auto& point : best->finest().points) {
      low = std::min(low, point.front());
      high = std::max(high, point.front());
    }
    range = high > low ? high - low : std::abs(high);
  }
  result_.size = range > 0 ? range : 1;
  result_.allowed = goal_.budget.of(result_.size);
}

// All trials together cost at most as much as the run, or little. The time of a core is asked only
// beyond that of the run, and few scenes reach it: the others' choices depend on no machine.
bool Chooser::affordable(const MethodTrials& next) const {
  if (cheaper_than_run(next)) return true;
  const double expected = rate() * (spent() + next.next_cost());
  // A method that turned out to be dear leaves the others their part.
  const double free = kFree / weight_;
  double taken = 0;
  for (const MethodTrials& each : trials_) taken += std::min(each.spent(), kOfOne * free);
  return taken + next.next_cost() <= free && lost_ + expected <= free_seconds();
}

double Chooser::least_known() const {
  double least = HUGE_VAL;
  for (const MethodTrials& each : trials_) least = std::min(least, predicted_cost(each));
  return least;
}

// Trials may take as long as the run, where that takes more than a second.
double Chooser::free_seconds() const {
  constexpr double kShortRun = 1;
  const double run = rate() * least_known();
  return run > kShortRun ? std::min(run, kFreeSeconds) : kFreeSeconds;
}

// Dear methods may have left nothing for the one that would tell.
bool Chooser::affordable_check(const MethodTrials& next) const {
  return affordable(next) || checks_ + next.next_cost() <= kFreeChecks / weight_;
}

double Chooser::spent() const {
  double sum = 0;
  for (const MethodTrials& each : trials_) sum += each.spent();
  return sum;
}

// The cost of the run is not known by trials that come no closer.
bool Chooser::cheaper_than_run(const MethodTrials& next) const {
  if (next.idle()) return false;
  double run = HUGE_VAL;
  for (const MethodTrials& each : trials_)
    run = std::min(run, whole(each.least_cost(kAim * in_window())));
  return spent() + next.next_cost() <= run;
}

double Chooser::ahead() const {
  double least = HUGE_VAL;
  for (const MethodTrials& each : trials_) {
    const double both = 1 + Refinement(each.method()).dearer();
    least = std::min(least, both * predicted_cost(each));
  }
  return least;
}

// A trial that falls far behind is given up before its time is over.
bool Chooser::refine(MethodTrials& method) {
  constexpr double kPart = 0.25;   // of the time that is left, for one trial
  constexpr double kBehind = 3;    // times slower than it may be
  constexpr double kJudged = 0.2;  // of that time, before which starts may be slow
  const bool may_last = cheaper_than_run(method);
  const double begin = seconds(), most = kPart * std::max(0.0, free_seconds() - begin);
  const double later = ahead();
  bool late = false;
  const bool done = method.refine([&](double part) {
    const double taken = seconds() - begin;
    const bool behind = taken > kJudged * most && kBehind * part * most < taken;
    late = late || (!may_last && (behind || taken > most));
    return go_on(method.method().label, part, method.next_cost(), later) && !late;
  });
  if (!done && !told_) {  // others may be quicker
    method.give_up();
    lost_ += seconds() - begin;
  }
  measure_range();
  return !told_;
}

MethodTrials* Chooser::cheapest() {
  MethodTrials* best = nullptr;
  double least = HUGE_VAL;
  for (MethodTrials& each : trials_) {
    if (each.error() > kMeaningful * result_.size) continue;
    const double cost = each.predict(kAim * in_window()).cost;
    if (cost < least) {
      least = cost;
      best = &each;
    }
  }
  return best;
}

// The method with the cheapest next run is refined next, until none can become cheaper than the
// cheapest that is known to meet the error. Until an error is known, one that has run is refined
// before others begin, whose costs are guesses.
void Chooser::race() {
  while (!told_) {
    const double allowed = kAim * in_window();
    double known = HUGE_VAL;
    bool any = false;
    for (const MethodTrials& each : trials_) {
      any = any || std::isfinite(each.error());
      if (each.error() <= allowed) known = std::min(known, each.predict(allowed).cost);
    }
    const auto rank = [&](const MethodTrials& each) {
      return std::pair(any || !each.finest().finished, each.next_cost());
    };
    MethodTrials* next = nullptr;
    for (MethodTrials& each : trials_) {
      const bool open = each.can_refine() && !(each.error() <= allowed) &&
                        each.least_cost(allowed) < known && affordable(each);
      if (open && (!next || rank(each) < rank(*next))) next = &each;
    }
    if (!next || !refine(*next)) return;
  }
}

// The run of another family that keeps the error longest, or is closest; or, if there is none, of
// another method; where no other has run, the one whose trial costs least.
MethodTrials* Chooser::check_for(const MethodTrials& chosen) {
  MethodTrials* check = nullptr;
  const auto rank = [&](const MethodTrials& each) {
    const bool ran = each.error() <= std::max(in_window(), kMeaningful * result_.size),
               other = other_family(each.method(), chosen.method());
    return std::tuple(may_miss_pulse(each), !ran, !other, -each.kept_share(in_window()),
                      ran ? each.error() : each.next_cost());
  };
  for (MethodTrials& each : trials_) {
    if (&each == &chosen || !(std::isfinite(each.error()) || each.can_refine())) continue;
    if (!check || rank(each) < rank(*check)) check = &each;
  }
  return check;
}

// If two families differ by more than their error estimates, neither is believed until both are
// refined; one that may have gone past a pulse is refined alone, as long as that is cheaper than
// the check, and not believed where no check is affordable.
bool Chooser::agrees(MethodTrials& chosen, MethodTrials& check) {
  TrialPair both = pair(chosen, check);
  const bool must = sees_more(check, chosen), ran = std::isfinite(check.error());
  if (both.agree(0.1 * in_window()) && (ran || !must)) return true;
  if (must && !ran) {
    chosen.doubt(HUGE_VAL);
    chosen.give_up();
    return false;
  }
  if (!must) {
    const double of_chosen = both.beyond(check), of_check = both.beyond(chosen);
    chosen.doubt(of_chosen);
    check.doubt(of_check);
    for (MethodTrials* each : {&chosen, &check})
      if (each->can_refine() && affordable(*each) && !refine(*each)) return false;
    return false;
  }
  const double most = check.predict(kAim * in_window()).cost;
  do {
    chosen.doubt_coarse_runs(both.apart());
    if (!chosen.can_refine() || chosen.next_cost() > most || !affordable(chosen)) {
      chosen.give_up();
      return false;
    }
    if (!refine(chosen)) return false;
    both = pair(chosen, check);
  } while (!both.agree(0.1 * in_window()));
  return false;
}

MethodTrials* Chooser::choose_checked() {
  constexpr int kRounds = 8;
  race();
  MethodTrials* chosen = cheapest();
  for (int round = 0; chosen && !told_ && round < kRounds; ++round) {
    MethodTrials* check = check_for(*chosen);
    if (!check) break;
    const double most = kCheckCost * chosen->predict(kAim * in_window()).cost;
    // A check that is off by more than the error allowed tells nothing of a cheap run that steps
    // over what happens; it may cost more where the two differ by as much.
    const bool must = sees_more(*check, *chosen);
    while (check->error() > in_window() && check->can_refine() && affordable_check(*check) &&
           (must || check->next_cost() <= most || pair(*chosen, *check).apart() > in_window())) {
      const double before = check->spent();
      if (!refine(*check)) return nullptr;
      checks_ += check->spent() - before;
    }
    if (agrees(*chosen, *check)) break;
    if (told_) return nullptr;
    race();
    chosen = cheapest();
  }
  const double aim = kAim * in_window();
  if (chosen && !told_ && !may_miss_pulse(*chosen) && chosen->can_coarsen(aim)) {
    const double cost = chosen->predict(aim).cost, later = ahead();
    chosen->coarsen(aim,
                    [&](double part) { return go_on(chosen->method().label, part, cost, later); });
  }
  return chosen;
}

// The fineness of the whole run; trials predict nothing of runs far finer than they were.
double Chooser::predicted_fineness(const MethodTrials& chosen) const {
  const double longer = longer_than_window(chosen), tried = chosen.fineness() * longer;
  const double fineness = longer * chosen.predict(kAim * in_window()).fineness;
  return fineness > 0 ? std::min(fineness, (chosen.idle() ? 1 : kMostTimesFiner) * tried) : tried;
}

double Chooser::own_fineness(const MethodTrials& own) const {
  if (Refinement(own.method()).by_tolerance()) return 1 / kFirstGoalTolerance;
  return std::max(result_.time / goal_trials_.step(),
                  std::ceil(kInPulse * result_.time / goal_trials_.pulse()));
}

// The scene's own run, whose step has served somebody, costs far less.
bool Chooser::is_far_dearer_than_own(double cost) {
  constexpr double kFar = 8;
  const Candidate& method = own().method();
  if (!goal_.asked || goal_.dt > 0 || method.info.implicit || method.info.adaptive) return false;
  return method.name == own_name() &&
         cost > kFar * own_fineness(own()) * std::max(1, method.info.evaluations);
}

// Both runs may step over the same event; trials of other methods that know better say so, if they
// looked as closely or chose their steps. One that contradicts is refined first: its error may be
// larger than it seemed.
void Chooser::hear_others(const MethodTrials& chosen, CheckedRun& checked) {
  constexpr int kMostRefined = 2;  // times
  if (result_.window != result_.time) return;
  for (MethodTrials& other : trials_) {
    const bool knows =
        &other != &chosen && other.own_error() <= result_.allowed && !may_miss_pulse(other);
    const bool close =
        Refinement(other.method()).by_tolerance() || other.finest().cost >= checked.seen().cost;
    if (!knows || !close) continue;
    for (int left = kMostRefined; checked.contradicts(other.finest(), other.own_error()); --left) {
      if (left > 0 && other.can_refine() && affordable(other) && refine(other)) continue;
      checked.believe(other.finest(), other.own_error());
      break;
    }
  }
}

// The run, which is expected to have this cost, and its refined run, whose errors are `falls` times
// smaller. False if it was interrupted.
bool Chooser::check(const MethodTrials& chosen, double cost, double falls, CheckedRun& checked) {
  const Candidate& method = chosen.method();
  const double dearer = Refinement(method).dearer();
  const auto watch = [&](const std::string& what, double own, double later) {
    return [=, this](double part) { return go_on(method.label + what, part, own, later); };
  };
  if (!checked.run(watch(", the run", cost, dearer * cost))) return false;
  if (!checked.refine(goal_trials_.corrected(),
                      watch(", the refined run", dearer * checked.seen().cost, 0)))
    return false;
  checked.compare(falls);
  hear_others(chosen, checked);
  return !checked.kept() || check_between(checked);
}

bool Chooser::check_between(CheckedRun& checked) {
  const double cost = checked.seen().cost;
  if (!checked.seen().acted_at_ends) return true;
  return checked.run_between(
      [&](double part) { return go_on(checked.method().label + ", between", part, cost, 0); });
}

// A run finer than one that has shown chaos keeps the error little longer.
bool Chooser::is_chaotic(CheckedRun& checked) {
  constexpr double kLittleLonger = 3;
  if (checked.horizon() < kLittleLonger * chaotic_from_) return true;
  const double cost = checked.fine().cost;
  const bool chaotic = checked.is_chaotic(goal_trials_.corrected(), result_.size, [&](double part) {
    return go_on("neighbour", part, cost, 0);
  });
  if (chaotic) chaotic_from_ = checked.horizon();
  return chaotic;
}

// Keeps the run if it is the best so far.
void Chooser::keep(CheckedRun&& checked, bool from_scene) {
  if (!(checked.horizon() > (best_ ? best_->horizon() : -1)) ||
      (from_scene && !checked.seen().finished))
    return;
  best_.emplace(std::move(checked));
  result_.from_scene = from_scene && best_->method().name == own_name();
  result_.chaotic = false;
}

// A horizon is checked only where nothing better follows.
void Chooser::tell_best() {
  if (!best_) return;
  if (!told_ && !best_->kept()) check_between(*best_);
  result_.method = best_->method();
  result_.dt = is_fixed(best_->method()) ? goal_.dt
                                         : result_.time / static_cast<double>(best_->plan().steps);
  result_.tolerance = best_->plan().tolerance;
  result_.error = best_->error();
  result_.largest = best_->largest();
  result_.cost = best_->seen().cost;
  result_.check = best_->check_cost();
  result_.kept = best_->kept();
  result_.horizon = best_->horizon();
}

// The run and its refined run; repeated with smaller steps if it misses the goal.
void Chooser::run_whole(MethodTrials& chosen, const Beginning& beginning) {
  double fineness = beginning.fineness;
  const Candidate& method = chosen.method();
  const Refinement refinement(method);
  const double tried = chosen.fineness() * longer_than_window(chosen);
  const double dearer = refinement.dearer();
  Mending mending(refinement, chosen.exponent(),
                  {.allowed = result_.allowed,
                   .enough = chosen.kept_at(in_window()) * longer_than_window(chosen),
                   .finest = tried > 0 ? kMostTimesFiner * kMostTimesFiner * tried : HUGE_VAL,
                   .most_cost = beginning.most_cost});
  double expected = whole(chosen.cost_at(fineness / longer_than_window(chosen)));
  for (int attempt = 0;; ++attempt) {
    TrialRun plan = trial_run(method, fineness, goal_trials_.states_in(method, result_.time));
    if (is_fixed(method))
      plan.steps = static_cast<std::int64_t>(std::ceil(result_.time / goal_.dt - 1e-9));
    if (!refinement.by_tolerance()) fineness = static_cast<double>(plan.steps);
    CheckedRun checked(problem_, method, plan, result_.time, result_.allowed, runs_cost_);
    const double falls = elementary::pow(refinement.factor(), -mending.exponent());
    if (!check(chosen, expected, falls, checked)) return;
    const double cost = checked.seen().cost, error = checked.error();
    const bool last = checked.kept() || is_fixed(method) || attempt == beginning.most_mendings;
    const bool chaotic = !last && attempt == 0 && error > 10 * result_.allowed && !problem_.of &&
                         is_chaotic(checked);
    keep(std::move(checked), beginning.from_scene);
    if (last || told_) return;
    result_.chaotic = chaotic;
    if (chaotic) return;
    const double free = std::min(kFree / weight_, kFreeSeconds / (rate() * (1 + dearer)));
    const std::optional<double> finer = mending.after(fineness, error, cost, free);
    if (!finer) return;
    fineness = *finer;
    expected = mending.cost();
    result_.mended = attempt + 1;
  }
}

// The scene's own method, or the one whose trial costs least; rather one that misses no pulse.
MethodTrials& Chooser::own() {
  return *std::ranges::min_element(trials_, {}, [&](const MethodTrials& each) {
    return std::tuple(may_miss_pulse(each), each.method().name != own_name(), each.next_cost());
  });
}

void Chooser::tell_candidates() {
  const double allowed = kAim * in_window();
  for (const MethodTrials& each : trials_) {
    GoalCandidate told{each.method().label, whole(each.predict(allowed).cost), each.exponent(),
                       each.runs(), ""};
    result_.cost_of_ten = std::min(result_.cost_of_ten, whole(each.predict(10 * allowed).cost));
    result_.candidates.push_back(std::move(told));
  }
  std::ranges::stable_sort(result_.candidates, {}, &GoalCandidate::cost);
}

GoalChoice Chooser::choose() {
  constexpr double kPart = 0.5;
  trials_ = goal_trials_.of(result_.window);
  begin_ = std::clock();  // what came before says nothing of an evaluation
  MethodTrials* const checked = choose_checked();
  MethodTrials* const chosen =
      checked || told_ ? checked : longest_kept(problem_, trials_, in_window());
  const double cost = checked ? predicted_cost(*checked) : HUGE_VAL;
  if (!told_) tell_candidates();
  if (!told_ && (checked ? is_far_dearer_than_own(cost) : goal_.asked && !(chosen && goal_.dt > 0)))
    run_whole(own(), {own_fineness(own()), kMostMendings, kPart * cost, true});
  const int mendings = checked || goal_.asked ? kMostMendings : 0;
  if (!told_ && chosen && !(best_ && best_->kept()))
    run_whole(*chosen, {predicted_fineness(*chosen), mendings});
  tell_best();
  result_.trials = done() + given_up() - result_.cost - result_.check;
  result_.complete = !told_;
  return std::move(result_);
}

}  // namespace

MethodChoice GoalChoice::integrator() const {
  MethodChoice choice = *method;
  if (tolerance > 0) choice.given["tol"] = tolerance;
  return choice;
}

void GoalChoice::miss_pulse(double t) {
  kept = false;
  missed_at = t;
  horizon = std::min(horizon, t);
}

GoalChoice choose_for_error(const Problem& problem, const ErrorGoal& goal, const Watch& watch) {
  return Chooser(problem, goal, watch).choose();
}

}  // namespace sim::study
