#include "core/session/timeline.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/base/assert.h"
#include "core/base/error.h"

namespace sim {
namespace {

constexpr std::int64_t kStride = 64;      // steps between two snapshots, before any are thinned out
constexpr std::int64_t kAtOnce = 8;       // steps without asking whether to go on
constexpr std::size_t kActionShare = 16;  // of the budget: actions between two snapshots

}  // namespace

Timeline::Timeline(const Simulation& simulation, std::size_t budget)
    : budget_(budget), last_(simulation.step_count()), start_(simulation.energy().total()) {
  note(simulation, false);
}

void Timeline::begin_anew(const Simulation& simulation) {
  auto look = std::move(look_);
  *this = Timeline(simulation, budget_);
  look_ = std::move(look);
}

void Timeline::note(const Simulation& simulation, bool edited, bool stays) {
  marks_.push_back(
      {std::make_shared<Snapshot>(simulation.snapshot()), edited, edited || stays, start_, done_});
  bytes_ += marks_.back().state->bytes() + sizeof(Mark);
  SIM_ASSERT(std::ranges::is_sorted(marks_, {}, [](const Mark& mark) { return mark.state->step; }));
  SIM_ASSERT(done_ <= acts_.size());
  if (bytes_ > budget_) thin();
}

void Timeline::count_bytes() {
  bytes_ = acts_.size() * sizeof(Act);
  for (const Mark& mark : marks_) bytes_ += mark.state->bytes() + sizeof(Mark);
}

void Timeline::part(const Simulation& simulation) {
  close_edit(simulation);
  ++part_;
}

void Timeline::close_edit(const Simulation& simulation) {
  if (!edit_open_) return;
  start_ = start_energy(simulation);
  edit_open_ = false;
  note(simulation, true);
}

std::size_t Timeline::mark_at_or_before(std::int64_t step) const {
  const auto after =
      std::upper_bound(marks_.begin(), marks_.end(), step,
                       [](std::int64_t n, const Mark& mark) { return n < mark.state->step; });
  return static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - marks_.begin() - 1, 0));
}

void Timeline::restore(Simulation& simulation, std::size_t mark) {
  SIM_ASSERT(mark < marks_.size() && marks_[mark].acts <= acts_.size());
  simulation.restore(*marks_[mark].state);
  start_ = marks_[mark].start;
  done_ = marks_[mark].acts;
  // Restores the motions that were in progress then.
  moves_ = forgotten_.moves;
  for (std::size_t i = 0; i < done_; ++i) moves_.note(acts_[i].action, acts_[i].step);
  moves_.forget_ended(simulation.step_count());
  perform_due(simulation);
}

// --- Actions ----------------------------------------------------------------------------------

// The energy that comes and goes at once, with a particle that is grabbed, moves the start.
void Timeline::perform(Simulation& simulation, const Action& action, std::int64_t step) {
  const bool moves = action.what == Action::What::kMove;
  const double before = moves ? 0 : simulation.energy().total();
  apply(simulation, action);
  if (!moves) start_ += simulation.energy().total() - before;
  moves_.note(action, step);
  ++touches_;
}

// All that the present step asks for: moves end, then what was done here is done again.
void Timeline::perform_due(Simulation& simulation) {
  const std::int64_t now = simulation.step_count();
  if (next_due() > now) return;
  if (look_) look_();
  if (moves_.end_due(simulation)) ++touches_;
  for (; done_ < acts_.size() && acts_[done_].step <= now; ++done_)
    perform(simulation, acts_[done_].action, acts_[done_].step);
}

// The next step at which something is to be done; the largest number if there is none.
std::int64_t Timeline::next_due() const {
  const std::int64_t end = moves_.due();
  return done_ < acts_.size() ? std::min(end, acts_[done_].step) : end;
}

void Timeline::discard_after(const Simulation& simulation) {
  last_ = simulation.step_count();
  acts_.resize(done_);
  marks_.resize(mark_at_or_before(last_) + 1);
  count_bytes();
}

void Timeline::act(Simulation& simulation, const Action& action) {
  if (action.what == Action::What::kReset)
    throw Error(ErrorKind::kInternal, {"a timeline cannot begin anew", "", "", ""});
  close_edit(simulation);
  perform(simulation, action, simulation.step_count());
  discard_after(simulation);
  SIM_ASSERT(acts_.empty() || acts_.back().step <= last_);
  acts_.push_back({last_, part_, action});
  done_ = acts_.size();
  bytes_ += sizeof(Act);
  // The time of a step follows from the step size of the mark before it.
  const bool stays = action.what == Action::What::kDt || action.what == Action::What::kIntegrator;
  const std::size_t since_mark = (done_ - marks_.back().acts) * sizeof(Act);
  if (stays || since_mark > std::max(budget_ / kActionShare, marks_.back().state->bytes()))
    note(simulation, false, stays);
  else if (bytes_ > budget_)
    thin();
}

// --- Snapshots --------------------------------------------------------------------------------

// The older a part is, the fewer snapshots it keeps: every second one of the older three quarters
// goes, until there is room. Where only changes are left, or actions take most of the budget, the
// oldest part of the timeline goes.
void Timeline::thin() {
  while (bytes_ > budget_ && marks_.size() > 1) {
    const bool actions = acts_.size() * sizeof(Act) > budget_ / 2;
    if (actions || !thin_marks()) forget_oldest();
    count_bytes();
  }
}

// False: all of them stay.
bool Timeline::thin_marks() {
  const std::size_t before = marks_.size(), older = before * 3 / 4;
  std::size_t kept = 1;
  bool dropped = false;
  for (std::size_t i = 1; i < before; ++i) {
    dropped = !dropped && i < older && i + 1 < before && !marks_[i].stays;
    if (!dropped) marks_[kept++] = std::move(marks_[i]);
  }
  marks_.resize(kept);
  return kept < before;
}

// A quarter of the snapshots, and the actions before the first one that is left.
void Timeline::forget_oldest() {
  const std::size_t count = std::max<std::size_t>(1, marks_.size() / 4);
  marks_.erase(marks_.begin(), marks_.begin() + static_cast<std::ptrdiff_t>(count));
  const std::size_t acts = std::min(marks_.front().acts, done_);
  for (std::size_t i = 0; i < acts; ++i) {
    forgotten_.moves.note(acts_[i].action, acts_[i].step);
    forgotten_.parts += acts_[i].part != forgotten_.part ? 1 : 0;
    forgotten_.part = acts_[i].part;
  }
  forgotten_.moves.forget_ended(marks_.front().state->step);
  forgotten_.acts += acts;
  acts_.erase(acts_.begin(), acts_.begin() + static_cast<std::ptrdiff_t>(acts));
  SIM_ASSERT(!marks_.empty() && acts <= done_);
  done_ -= acts;
  for (Mark& mark : marks_) mark.acts -= acts;
}

void Timeline::set_budget(std::size_t bytes) {
  budget_ = bytes;
  thin();
}

int Timeline::steps(Simulation& simulation, std::int64_t most) {
  close_edit(simulation);
  const std::int64_t before = simulation.step_count();
  if (before < last_) {
    // Not past a change that was made, and is to be made again; a shorter step is as it was.
    std::int64_t end = last_;
    for (std::size_t i = 0; i < marks_.size(); ++i) {
      const std::int64_t at = marks_[i].state->step;
      if (at <= before || !(marks_[i].edited || marks_[i].cut)) continue;
      if (marks_[i].cut && at == before + 1) {
        restore(simulation, mark_at_or_before(at));
        return 1;
      }
      end = std::min(end, marks_[i].cut ? at - 1 : at);
    }
    most = std::min(most, end - before);
  }
  most = std::min(most, next_due() - before);
  const int taken = simulation.steps(most);
  if (taken == 0) return 0;
  const std::int64_t now = simulation.step_count();
  if (now > last_) {
    last_ = now;
    perform_due(simulation);
    if (now - marks_.back().state->step >= kStride) note(simulation, false);
    return taken;
  }
  if (const std::size_t mark = mark_at_or_before(now);
      marks_[mark].state->step == now && marks_[mark].edited)
    restore(simulation, mark);
  else
    perform_due(simulation);
  return taken;
}

bool Timeline::step_to(Simulation& simulation, double end) {
  close_edit(simulation);
  discard_after(simulation);
  if (!simulation.step_to(end)) return false;
  last_ = simulation.step_count();
  note(simulation, false, true);
  marks_.back().cut = true;
  perform_due(simulation);
  return true;
}

void Timeline::edit(Simulation& simulation, const std::function<void(Simulation&)>& change) {
  const double before = edit_open_ ? before_edit_ : simulation.energy().total();
  change(simulation);
  before_edit_ = before;
  edit_open_ = true;
  discard_after(simulation);
}

bool Timeline::undo(Simulation& simulation) {
  close_edit(simulation);
  std::size_t mark = mark_at_or_before(simulation.step_count());
  while (mark > 0 && !marks_[mark].edited) --mark;
  if (done_ > 0 && (mark == 0 || marks_[mark].acts < done_)) {  // actions came last
    std::size_t first = done_ - 1;
    const std::size_t least = mark == 0 ? 0 : marks_[mark].acts;
    while (first > least && acts_[first - 1].part == acts_[done_ - 1].part) --first;
    const bool begun_before = first == 0 && acts_[first].part == forgotten_.part;
    if (marks_.front().acts > first || begun_before) return false;  // too old
    last_ = acts_[first].step;
    acts_.resize(first);
    std::erase_if(marks_,
                  [&](const Mark& each) { return each.state->step > last_ || each.acts > first; });
    count_bytes();
    return enter(simulation, last_, [] { return true; });
  }
  if (mark == 0) return false;
  last_ = marks_[mark].state->step;
  acts_.resize(marks_[mark].acts);
  marks_.resize(mark);
  count_bytes();
  return enter(simulation, last_, [] { return true; });
}

bool Timeline::go_to(Simulation& simulation, std::int64_t step,
                     const std::function<bool()>& go_on) {
  close_edit(simulation);
  const std::int64_t now = simulation.step_count();
  const std::size_t mark = mark_at_or_before(std::min(step, last_));
  if (now > step || now < marks_[mark].state->step) restore(simulation, mark);
  while (simulation.step_count() < step)
    if (!go_on() || steps(simulation, std::min(step - simulation.step_count(), kAtOnce)) == 0)
      return false;
  return true;
}

void Timeline::keep(const Simulation& simulation) {
  close_edit(simulation);
  const std::int64_t now = simulation.step_count();
  if (marks_[mark_at_or_before(now)].state->step == now) return;
  note(simulation, false);
  std::ranges::stable_sort(marks_, {}, [](const Mark& each) { return each.state->step; });
}

bool Timeline::enter(Simulation& simulation, std::int64_t step,
                     const std::function<bool()>& go_on) {
  restore(simulation, mark_at_or_before(step));
  return go_to(simulation, step, go_on);
}

std::int64_t Timeline::step_at(const Simulation& simulation, double t) {
  close_edit(simulation);
  std::size_t mark = marks_.size() - 1;
  while (mark > 0 && marks_[mark].state->t() > t) --mark;
  const Snapshot& state = *marks_[mark].state;
  const double steps = std::round((t - state.t()) / state.settings->h);
  constexpr double kMost = 9e15;
  std::int64_t step = state.step + static_cast<std::int64_t>(std::clamp(steps, 0.0, kMost));
  if (mark + 1 < marks_.size()) step = std::min(step, marks_[mark + 1].state->step);
  return step;
}

int Timeline::edits() const {
  const auto edited =
      std::count_if(marks_.begin() + 1, marks_.end(), [](const Mark& mark) { return mark.edited; });
  int parts = forgotten_.parts, part = forgotten_.part;
  for (const Act& act : acts_) parts += std::exchange(part, act.part) != act.part ? 1 : 0;
  return static_cast<int>(edited) + parts + (edit_open_ ? 1 : 0);
}

double Timeline::start_energy(const Simulation& simulation) const {
  return edit_open_ ? start_ + (simulation.energy().total() - before_edit_) : start_;
}

void Timeline::set_start(double energy) { start_ = marks_.front().start = energy; }

std::int64_t Timeline::common(const Timeline& other) const {
  for (auto mark = marks_.rbegin(); mark != marks_.rend(); ++mark)
    for (std::size_t i = other.mark_at_or_before(mark->state->step);; --i) {
      if (other.marks_[i].state == mark->state) return mark->state->step;
      if (i == 0 || other.marks_[i].state->step != mark->state->step) break;
    }
  return -1;
}

}  // namespace sim
