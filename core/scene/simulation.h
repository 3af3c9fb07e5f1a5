// A compiled scene: immutable structure, mutable state X, time t = n h.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/base/thread_count_tuner.h"
#include "core/particles/contacts.h"
#include "core/plugin/registry.h"
#include "core/scene/divergence.h"
#include "core/scene/scene_spec.h"
#include "core/scene/snapshot.h"

namespace sim {

class StepCorrection;

// The options that a run may override; empty or 0: those of the scene.
struct RunOptions {
  MethodChoice integrator{};
  double dt = 0;  // s
  Threads threads{};
};

// The islands of a scene, and those asleep.
struct SleepAccount {
  int islands = 0, asleep = 0;
  double since = 0;  // s, when the last of those asleep fell asleep
  double taken = 0;  // J, of kinetic energy, by falling asleep so far
};

struct Energy {
  double kinetic = 0, potential = 0;  // J
  double total() const { return kinetic + potential; }
};

class Simulation {
 public:
  // Throws Error{kScene} or Error{kPlugin}; afterwards only code written in Lua can throw.
  Simulation(const SystemSpec& spec, Registry& registry, const RunOptions& options = {});
  ~Simulation();
  Simulation(Simulation&&) noexcept;
  Simulation& operator=(Simulation&&) noexcept;

  // Takes one step of size h. False if it fails: nothing changes; divergence() tells why and where.
  bool step();
  // Takes up to `most` steps, storing only the last state; returns their number, 0 if none could.
  int steps(std::int64_t most);
  bool step_to(double end);  // a shorter one, to that time; those after it have the size h again
  void stop_when(std::function<bool()> stop);  // asked in long steps: true ends them, kStopped
  const Divergence& divergence() const;
  void reset();  // to t = 0 with the initial bits; changed settings stay, but hands let go

  double t() const;
  double t(std::int64_t step) const;  // of that step, if nothing is changed in between
  double h() const;
  std::int64_t step_count() const;
  std::int64_t steps_for(double duration) const;  // the fewest steps that reach it

  const std::string& name() const;
  double duration() const;  // s
  const Method& method() const;
  IntegratorInfo integrator_info() const;
  const Integrator& integrator() const;
  const Settings& settings() const;
  const OdeSystem& ode() const;
  OdeSystem& ode();                       // for studies: the right-hand side, and
  std::span<const double> state() const;  // X
  const StateShape& shape() const;        // the layout of X
  bool second_order() const;              // has particles with masses, velocities and energy
  bool flat() const;                      // a flat ODE state: no particles
  int particles() const;                  // 0 for a flat state
  int threads() const;                    // that steps run on now
  int pinned_count() const;
  Vec3 position(int i) const;
  Vec3 velocity(int i) const;
  int components() const;            // numbers of a first-order state
  double component(int i) const;     // first-order states, in the order of FirstOrderSpec::state
  SleepAccount sleep() const;        // zeros where the scene asks for none
  ContactWork contact_work() const;  // J, of all steps so far, whatever was restored between them
  std::vector<RenderShape> shapes() const;  // of colliders that are on and of bodies, as now
  int bodies() const;
  const RigidBody& body(int i) const;
  RigidState body_state(int i) const;
  bool conserves_energy() const;  // gravity and springs only, without drag: the total must stay
  Energy energy() const;          // second order only
  std::uint64_t hash() const;     // of the bits of the state and the step count
  Snapshot snapshot() const;
  Snapshot snapshot_without_state() const;  // for who reads state()
  void restore(const Snapshot& snapshot);   // of this system: it goes on from there bit for bit
  // Changes between two steps, in m and m/s. Each throws Error{kUsage}, or an error of a plugin,
  // and then leaves all as it was. A particle that is pinned or unpinned is at rest.
  void set_position(int i, const Vec3& x);
  void set_velocity(int i, const Vec3& v);
  void set_component(int i, double value);
  void set_pinned(int i, bool hold);
  // Holds a particle for the user: while held it keeps the given velocity; released, it flies on.
  void set_held(int i, bool hold);
  bool pinned(int i) const;
  void set_switch(const std::string& name, bool on);
  // Breaks the breakable ties between two particles. Throws Error{kUsage} if there are none.
  void cut(int a, int b);
  std::vector<std::pair<std::string, bool>> switches() const;  // name, on; in order of names
  void set_dt(double new_h);                                   // t goes on from where it is
  void set_integrator(const Method& method);

  std::vector<ForceShare> forces_on(int particle) const;  // a pinned one feels them too
  std::vector<std::vector<ForceShare>> forces_on(int begin, int end) const;  // each of these
  class ConstraintSystem* constraint_system() const;  // of constraints; null where there are none
  std::span<const std::unique_ptr<StepCorrection>> corrections() const;  // of the ends of steps
  std::vector<Link> links(int particle) const;                           // in order of families
  std::vector<std::pair<std::string, long>> families() const;  // (family, number of springs)
  int breakable_ties() const;     // that may break: of forces, and behind these of constraints
  int breakable_springs() const;  // those of forces
  bool breaks() const { return breakable_ties() > 0; }
  std::span<const std::array<int, 2>> torn() const;  // pairs joined no more, the lower id first

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sim
