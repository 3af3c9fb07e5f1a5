// Islands of particles that take no steps because they rest.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/math/vec3.h"
#include "core/particles/particle_system.h"
#include "core/particles/subset.h"
#include "core/scene/simulation.h"

namespace sim {

// Elements of forces and constraints join particles to islands. One falls asleep, with all that are
// near enough to touch it, when the kinetic energy of each was below SleepSpec::energy at all looks
// for SleepSpec::after: its velocities become 0. The awake ones are a scene of their own, of these
// particles alone, so that methods, contact and threads are the same as ever, and the sleeping
// ones cost nothing. An island wakes when one that is awake comes near, a collider moves into it,
// or the forces on it are no longer those of the moment when it fell asleep.
class Sleep {
 public:
  // registry outlives it; particles: of the whole scene, likewise. Throws Error{kScene} where
  // forces or parts of the scene leave no islands, or remember.
  Sleep(const SystemSpec& spec, Registry& registry, Threads threads, ParticleSystem& particles);
  ~Sleep();

  bool any() const { return asleep_ > 0; }
  SleepAccount account() const;
  void reset();  // all wake, and nothing has been taken

  void wake(int particle);  // and all of its island
  void wake_all();
  // Settings or states were changed: the awake ones begin anew before the next step.
  void forget_scene() { scene_.reset(); }

  // The moments of looks, 16 in each `after`, follow from that alone; they are not evenly spaced,
  // so that no vibration rests at all of them. How many there are in [0, t], and the next one.
  std::int64_t looks_until(double t) const;
  double next_look(double t) const { return moment(looks_until(t)); }
  // Looks at the state x at t after steps from `from`, where a look is due: islands that have
  // rested fall asleep, and their velocities in x become 0; those wake on which forces have
  // changed.
  void look(double from, double t, double* x);

  // Islands may be disturbed in any step, by what moves.
  bool may_be_disturbed() const;
  // Before a step of h from x at t: wakes the disturbed ones.
  void wake_disturbed(double t, double h, const double* x);

  // The scene of all that is awake, at this snapshot of the whole scene, whose state is x; null:
  // nothing is awake.
  Simulation* awake_scene(const Snapshot& now, const double* x);
  Simulation* present_scene() const { return scene_.get(); }  // null: it begins anew
  void scatter(double* x) const;  // the state of that scene among that of all
  int id_of(int awake) const { return awake_.id(awake); }

  // All that the next steps depend on, as finite numbers; false where they are of another scene.
  std::vector<double> memory() const;
  bool recall(std::span<const double> memory, const double* x);

 private:
  struct Box {
    Vec3 low, high;
  };
  double moment(std::int64_t look) const;  // s
  std::size_t islands() const { return members_.size(); }
  Box box(std::size_t island, const ParticleView& view, double ahead) const;
  bool near(const Box& a, const Box& b) const;
  void wake_changed(double t, const double* x);
  std::vector<std::uint8_t> ready(double t, const ParticleView& view);
  bool touches_moving(std::size_t island, const ParticleView& view, double until);
  void accelerations(double t, const double* x);
  double gain(std::size_t island) const;
  void remember(std::size_t island);
  void rouse(std::size_t island);

  SystemSpec spec_;
  Registry* registry_;
  Threads threads_;
  ParticleSystem* particles_;
  double reach_ = 0;             // m, of contact; < 0: there is none, and islands never touch
  std::vector<Subset> members_;  // of each island
  std::vector<int> island_;      // of each particle
  std::vector<double> since_;    // s, of each island: below the energy, or asleep; < 0: neither
  std::vector<std::uint8_t> sleeps_;  // of each island
  std::vector<double> free_until_;    // s, of each that sleeps: no moving collider is there before
  std::vector<Box> boxes_;            // of each that sleeps
  Array then_, now_;                  // accelerations when each fell asleep, and at the last look
  int asleep_ = 0;
  double taken_ = 0;
  Subset awake_;  // the particles of scene_
  std::unique_ptr<Simulation> scene_;
};

}  // namespace sim
