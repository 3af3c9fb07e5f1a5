// Sleeping: islands of particles that take no steps because they rest.
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

// Bodies and elements of forces and constraints join particles to islands. One falls asleep, with
// all that are near enough to touch it, if the kinetic energy of each was below SleepSpec::energy
// at all checks for SleepSpec::after: its velocities become 0. The awake ones are a scene of their
// own, of these particles alone, so that methods, contact and threads are the same as without
// sleep, and the sleeping ones cost nothing. An island wakes when an awake one comes near, a
// collider moves into it, or the forces on it differ from those at the time when it fell asleep.
class Sleep {
 public:
  // registry outlives it; particles: of the whole scene, likewise. Throws Error{kScene} if forces
  // or parts of the scene leave no islands, or have internal variables.
  Sleep(const SystemSpec& spec, Registry& registry, Threads threads, ParticleSystem& particles);
  ~Sleep();

  bool any() const { return asleep_ > 0; }
  SleepAccount account() const;
  void reset();  // all wake, and nothing has been taken

  void wake(int particle);  // and all of its island
  void wake_all();
  // Settings or states were changed: the awake system restarts before the next step.
  void forget_scene() { scene_.reset(); }

  // The times of checks, 16 in each `after`, depend on that alone; they are not evenly spaced, so
  // that no vibration rests at all of them. Their number in [0, t], and the next one.
  std::int64_t looks_until(double t) const;
  double next_look(double t) const { return moment(looks_until(t)); }
  // Checks the state x at t after steps from `from`, if a check is due: islands that have rested
  // fall asleep, and their velocities in x become 0; islands whose forces have changed wake.
  void look(double from, double t, double* x);

  // True if islands may be disturbed in any step by moving objects.
  bool may_be_disturbed() const;
  // Called before a step of h from x at t: wakes the disturbed islands.
  void wake_disturbed(double t, double h, const double* x);

  // The awake scene, at this snapshot of the whole scene, whose state is x; null: all are asleep.
  Simulation* awake_scene(const Snapshot& now, const double* x);
  Simulation* present_scene() const { return scene_.get(); }  // null: it begins anew
  void scatter(double* x) const;  // the state of that scene among that of all
  int id_of(int awake) const { return awake_.id(awake); }

  // All that the next steps depend on, as finite numbers; recall() is false for those of another
  // scene.
  std::vector<double> memory() const;
  bool recall(std::span<const double> memory, const double* x);

 private:
  struct Box {
    Vec3 low, high;
  };
  // visit(center, velocity, radius), m, m/s: balls that hold what of an island touches others.
  template <class Visit>
  void for_each_ball(std::size_t island, const ParticleView& view, Visit&& visit) const;
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
  std::vector<double> radii_;    // m, of each body
  int first_of_bodies_ = 0;      // particle; bodies have the last ones
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
