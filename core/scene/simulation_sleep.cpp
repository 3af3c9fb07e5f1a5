// The steps of a simulation with sleeping islands.
#include <algorithm>

#include "core/scene/simulation_impl.h"
#include "core/scene/sleep.h"

namespace sim {

bool Simulation::Impl::some_sleep(double end) {
  if (!sleep || !sleep->any()) return false;
  const double now = t(step_count);
  sleep->wake_disturbed(now, end - now, x.data());
  if (!sleep->any()) begin_awake();
  return sleep->any();
}

// Once all are awake, the method of the whole scene and its corrections have no history.
void Simulation::Impl::begin_awake() {
  for (const auto& correction : corrections)
    if (correction->has_memory()) correction->recall({});
  restart();
}

std::int64_t Simulation::Impl::steps_to_look(std::int64_t most) const {
  if (sleep->may_be_disturbed()) return 1;
  // Without checks, a number of steps that is quickly counted.
  constexpr std::int64_t kMost = 4096;
  const double look = sleep->next_look(t(step_count));
  std::int64_t count = 1;
  while (count < std::min(most, kMost) && t(step_count + count) < look) ++count;
  return count;
}

int Simulation::Impl::advance_awake(std::int64_t most, std::optional<double> end) {
  const double from = t(step_count);
  int taken = end ? 1 : static_cast<int>(most);
  const bool anew = !sleep->present_scene();
  if (Simulation* const awake =
          sleep->awake_scene(Snapshot{settings, step_count, n0, t0, {}, {}}, x.data())) {
    if (anew) awake->stop_when(stop);
    const ContactWork before = awake->contact_work();
    taken = end ? awake->step_to(*end) : awake->steps(most);
    if (taken == 0) {
      divergence = awake->divergence();
      if (divergence.particle >= 0) divergence.particle = sleep->id_of(divergence.particle);
      return 0;
    }
    sleep->scatter(x.data());
    contact_work.lost += awake->contact_work().lost - before.lost;
    contact_work.given += awake->contact_work().given - before.given;
  }
  step_count += taken;
  if (end) {
    n0 = step_count;
    t0 = *end;
  }
  look_for_rest(from);
  return taken;
}

void Simulation::Impl::look_for_rest(double from) {
  if (!sleep) return;
  const bool some = sleep->any();
  sleep->look(from, t(step_count), x.data());
  if (some && !sleep->any()) begin_awake();
}

SleepAccount Simulation::sleep() const {
  return impl_->sleep ? impl_->sleep->account() : SleepAccount();
}

}  // namespace sim
