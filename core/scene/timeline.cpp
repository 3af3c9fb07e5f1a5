#include "core/scene/timeline.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

constexpr std::int64_t kStride = 64;  // steps between two snapshots, before any are thinned out

}  // namespace

Timeline::Timeline(const Simulation& simulation, std::size_t budget)
    : budget_(budget), last_(simulation.step_count()), start_(simulation.energy().total()) {
  note(simulation, false);
}

void Timeline::note(const Simulation& simulation, bool edited) {
  marks_.push_back({std::make_shared<Snapshot>(simulation.snapshot()), edited, start_});
  bytes_ += marks_.back().state->bytes() + sizeof(Mark);
  if (bytes_ > budget_) thin();
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
  simulation.restore(*marks_[mark].state);
  start_ = marks_[mark].start;
}

// The older a part is, the fewer snapshots it keeps: every second one of the older three quarters
// goes, until there is room. Where only changes are left, the oldest part of the timeline goes.
void Timeline::thin() {
  while (bytes_ > budget_ && marks_.size() > 1) {
    const std::size_t before = marks_.size(), older = before * 3 / 4;
    std::size_t kept = 1;
    bool dropped = false;
    for (std::size_t i = 1; i < before; ++i) {
      dropped = !dropped && i < older && i + 1 < before && !marks_[i].edited;
      if (!dropped) marks_[kept++] = std::move(marks_[i]);
    }
    marks_.resize(kept);
    if (kept == before)
      marks_.erase(marks_.begin(), marks_.begin() + static_cast<std::ptrdiff_t>(
                                                        std::max<std::size_t>(1, before / 4)));
    bytes_ = 0;
    for (const Mark& mark : marks_) bytes_ += mark.state->bytes() + sizeof(Mark);
  }
}

void Timeline::set_budget(std::size_t bytes) {
  budget_ = bytes;
  thin();
}

int Timeline::steps(Simulation& simulation, std::int64_t most) {
  close_edit(simulation);
  const std::int64_t before = simulation.step_count();
  if (before < last_) {
    // Not past a change that was made, and is to be made again.
    std::int64_t end = last_;
    for (const Mark& mark : marks_)
      if (mark.edited && mark.state->step > before) end = std::min(end, mark.state->step);
    most = std::min(most, end - before);
  }
  const int taken = simulation.steps(most);
  if (taken == 0) return 0;
  const std::int64_t now = simulation.step_count();
  if (now > last_) {
    last_ = now;
    if (now - marks_.back().state->step >= kStride) note(simulation, false);
    return taken;
  }
  if (const std::size_t mark = mark_at_or_before(now);
      marks_[mark].state->step == now && marks_[mark].edited)
    restore(simulation, mark);
  return taken;
}

void Timeline::edit(Simulation& simulation, const std::function<void(Simulation&)>& change) {
  const double before = edit_open_ ? before_edit_ : simulation.energy().total();
  change(simulation);
  before_edit_ = before;
  edit_open_ = true;
  last_ = simulation.step_count();
  marks_.resize(mark_at_or_before(last_) + 1);
  bytes_ = 0;
  for (const Mark& mark : marks_) bytes_ += mark.state->bytes() + sizeof(Mark);
}

bool Timeline::undo(Simulation& simulation) {
  close_edit(simulation);
  std::size_t mark = mark_at_or_before(simulation.step_count());
  while (mark > 0 && !marks_[mark].edited) --mark;
  if (mark == 0) return false;
  last_ = marks_[mark].state->step;
  marks_.resize(mark);
  return enter(simulation, last_, [] { return true; });
}

bool Timeline::go_to(Simulation& simulation, std::int64_t step,
                     const std::function<bool()>& go_on) {
  close_edit(simulation);
  const std::int64_t now = simulation.step_count();
  const std::size_t mark = mark_at_or_before(std::min(step, last_));
  if (now > step || now < marks_[mark].state->step) restore(simulation, mark);
  while (simulation.step_count() < step)
    if (!go_on() || steps(simulation, step - simulation.step_count()) == 0) return false;
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
  return static_cast<int>(edited) + (edit_open_ ? 1 : 0);
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
