// The steps of a simulation of which islands sleep.
#include "core/scene/simulation_impl.h"
#include "core/scene/sleep.h"

namespace sim {

// Where all have woken the method of the whole scene begins anew.
bool Simulation::Impl::some_sleep(double end) {
  if (!sleep || !sleep->any()) return false;
  const double now = t(step_count);
  sleep->wake_disturbed(now, end - now, x.data());
  if (!sleep->any()) begin_awake();
  return sleep->any();
}

void Simulation::Impl::begin_awake() {
  for (const auto& correction : corrections)
    if (correction->has_memory()) correction->recall({});
  restart();
}

bool Simulation::Impl::step_awake(double end, bool whole) {
  const Snapshot now{settings, step_count, n0, t0, {}, {}};
  const bool anew = !sleep->present_scene();
  if (Simulation* const awake = sleep->awake_scene(now, x.data())) {
    if (anew) awake->stop_when(stop);
    const ContactWork before = awake->contact_work();
    if (!(whole ? awake->step() : awake->step_to(end))) {
      divergence = awake->divergence();
      if (divergence.particle >= 0) divergence.particle = sleep->id_of(divergence.particle);
      return false;
    }
    sleep->scatter(x.data());
    contact_work.lost += awake->contact_work().lost - before.lost;
    contact_work.given += awake->contact_work().given - before.given;
  }
  ++step_count;
  if (!whole) {
    n0 = step_count;
    t0 = end;
  }
  fall_asleep();
  return true;
}

void Simulation::Impl::fall_asleep() {
  if (sleep) sleep->settle(t(step_count), x.data());
}

SleepAccount Simulation::sleep() const {
  return impl_->sleep ? impl_->sleep->account() : SleepAccount();
}

}  // namespace sim
