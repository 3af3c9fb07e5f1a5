// A scene under the control of users: its systems advance together, back and forth, and users act
// on them. All of it can be recorded.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/session/recording.h"
#include "core/session/timeline.h"

namespace sim {

// The first system is the clock: after each of its steps every other one advances until its time is
// not earlier. The step of a system is then a function of the clock alone.
class Player {
 public:
  // The systems outlive it, and nobody else steps them. `world`: their names distinguish them.
  Player(std::vector<Simulation>& systems, bool world,
         std::size_t budget = Timeline::kDefaultBudget);

  // Continues with known timelines; they are returned at the end.
  Player(std::vector<Simulation>& systems, bool world, std::vector<Timeline> timelines);
  std::vector<Timeline> take_timelines();

  void record(RecordingWriter& writer) { writers_.push_back(&writer); }  // which outlives it
  void end_record();  // of all writers, with the hashes of now

  std::size_t count() const { return systems_->size(); }
  Simulation& system(std::size_t i = 0) { return (*systems_)[i]; }
  const Timeline& timeline(std::size_t i = 0) const { return timelines_[i]; }
  void before_touch(std::size_t i, std::function<void()> look) {
    timelines_[i].before_touch(std::move(look));
  }
  std::int64_t step() const { return systems_->front().step_count(); }
  std::int64_t known() const { return timelines_.front().last(); }   // the last known step
  std::int64_t first() const { return timelines_.front().first(); }  // the earliest reachable step

  // Advances at most so many steps of the clock, at least one; 0: a step failed, see failed().
  std::int64_t advance(std::int64_t most);
  // The system whose step failed, if we are there; else -1.
  int failed() const { return failed_; }

  void act(std::size_t system, const Action& action);  // throws as apply()
  void part();                                         // the next actions are undone separately
  void reset();                                        // all; settings stay
  // Goes to a step of the clock, at least first(), at most known(). False: it could not be reached,
  // or `go_on`, polled between steps, says no; the same call continues from there.
  bool go_to(
      std::int64_t step, const std::function<bool()>& go_on = [] { return true; });
  bool undo();  // the last part, of any system; at the time it began
  std::int64_t step_at(double t) { return timelines_.front().step_at(system(), t); }

 private:
  bool follow();
  bool step_system(std::size_t i);
  void travelled(const std::vector<std::int64_t>& from);
  std::vector<std::int64_t> steps() const;

  std::vector<Simulation>* systems_;
  std::vector<std::string> names_;
  std::vector<Timeline> timelines_;
  std::vector<RecordingWriter*> writers_;
  int failed_ = -1;
  std::int64_t failed_step_ = -1;
};

}  // namespace sim
