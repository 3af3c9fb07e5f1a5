#include "core/session/player.h"

#include <algorithm>

namespace sim {
namespace {

constexpr double kSameTime = 1e-9;  // of a step: times closer than that are one

}  // namespace

Player::Player(std::vector<Simulation>& systems, bool world, std::size_t budget)
    : systems_(&systems) {
  for (const Simulation& each : systems) {
    names_.push_back(world ? each.name() : "");
    timelines_.emplace_back(each, budget / systems.size());
  }
}

Player::Player(std::vector<Simulation>& systems, bool world, std::vector<Timeline> timelines)
    : systems_(&systems), timelines_(std::move(timelines)) {
  for (const Simulation& each : systems) names_.push_back(world ? each.name() : "");
}

std::vector<Timeline> Player::take_timelines() {
  for (Timeline& each : timelines_) each.before_touch(nullptr);
  return std::move(timelines_);
}

std::vector<std::int64_t> Player::steps() const {
  std::vector<std::int64_t> all;
  for (const Simulation& each : *systems_) all.push_back(each.step_count());
  return all;
}

void Player::end_record() {
  for (RecordingWriter* writer : writers_)
    for (std::size_t i = 0; i < count(); ++i)
      writer->end(names_[i], system(i).step_count(), system(i).hash());
  writers_.clear();
}

bool Player::step_system(std::size_t i) {
  if (timelines_[i].step(system(i))) return true;
  failed_ = static_cast<int>(i);
  failed_step_ = step();
  return false;
}

bool Player::follow() {
  for (std::size_t i = 1; i < count(); ++i)
    while (system(i).t() < system(0).t() - kSameTime * system(i).h())
      if (!step_system(i)) return false;
  return true;
}

std::int64_t Player::advance(std::int64_t most) {
  if (failed_ >= 0) return 0;
  const std::int64_t before = step();
  if (count() > 1) return step_system(0) && follow() ? 1 : 0;
  if (timelines_.front().steps(system(), std::max<std::int64_t>(1, most)) > 0)
    return step() - before;
  failed_ = 0;
  failed_step_ = before;
  return 0;
}

void Player::act(std::size_t i, const Action& action) {
  timelines_[i].act(system(i), action);
  for (RecordingWriter* writer : writers_)
    writer->action(names_[i], system(i).step_count(), action);
  failed_ = -1;
}

void Player::part() {
  for (std::size_t i = 0; i < count(); ++i) timelines_[i].part(system(i));
}

void Player::reset() {
  for (std::size_t i = 0; i < count(); ++i) {
    for (RecordingWriter* writer : writers_) writer->reset(names_[i], system(i).step_count());
    system(i).reset();
    timelines_[i].begin_anew(system(i));
  }
  failed_ = -1;
}

// Records the travel of each system; steps forward need no record, as they are counted.
void Player::travelled(const std::vector<std::int64_t>& from) {
  for (RecordingWriter* writer : writers_)
    for (std::size_t i = 0; i < count(); ++i)
      if (system(i).step_count() < from[i])
        writer->back(names_[i], from[i], system(i).step_count());
  failed_ = -1;
}

bool Player::go_to(std::int64_t target, const std::function<bool()>& go_on) {
  const std::vector<std::int64_t> from = steps();
  target = std::clamp(target, first(), known());
  bool reached = timelines_.front().go_to(system(), target, go_on);
  for (std::size_t i = 1; reached && i < count(); ++i) {
    const std::int64_t near = timelines_[i].step_at(system(i), system().t());
    reached = timelines_[i].go_to(
        system(i), std::clamp(near, timelines_[i].first(), timelines_[i].last()), go_on);
  }
  travelled(from);
  return reached && follow();
}

bool Player::undo() {
  // The group of actions that began last is undone.
  std::size_t last = count();
  for (std::size_t i = 0; i < count(); ++i) {
    if (timelines_[i].actions() == 0) continue;
    if (last == count() || timelines_[i].part_of_last() > timelines_[last].part_of_last()) last = i;
  }
  if (last == count()) return false;
  const std::int64_t from = system(last).step_count();
  const std::size_t before = timelines_[last].actions();
  if (!timelines_[last].undo(system(last))) return false;
  for (RecordingWriter* writer : writers_)
    writer->undo(names_[last], before - timelines_[last].actions(), from,
                 system(last).step_count());
  failed_ = -1;
  if (count() == 1) return true;
  const double t = system(last).t();
  if (last == 0) return go_to(step());
  // The clock goes to the last step that is not later.
  std::int64_t target = std::clamp(step_at(t), first(), known());
  return go_to(target);
}

}  // namespace sim
