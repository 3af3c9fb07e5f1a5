// The inside of a Simulation, shared by the files that build, step and change it.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/array.h"
#include "core/base/error.h"
#include "core/base/thread_pool.h"
#include "core/fields/field_system.h"
#include "core/particles/contact_task.h"
#include "core/particles/particle_system.h"
#include "core/scene/at_source.h"
#include "core/scene/breaking.h"
#include "core/scene/simulation.h"

namespace sim {

class ImpactEvents;
class Sleep;

struct Simulation::Impl {
  std::string name;
  double duration = 0;
  std::int64_t step_count = 0, n0 = 0;  // t = t0 + (step_count - n0) h
  double t0 = 0;
  Divergence divergence;

  std::shared_ptr<const Settings> settings;
  std::unique_ptr<Integrator> integrator;
  std::unique_ptr<ThreadPool> pool;
  std::optional<ThreadCountTuner> thread_count_tuner;  // if the run may choose its threads
  std::unique_ptr<OdeSystem> system;
  ParticleSystem* particles = nullptr;       // the system, in a second-order scene
  std::vector<SourceLocation> force_places;  // of its forces, in their order
  StateShape shape;
  std::vector<RigidBody> bodies;
  std::vector<std::string> force_switches, collider_switches;  // of each part; empty: none
  ParticlesSpec initial;               // of a second-order scene: a grid takes no room
  std::vector<double> initial_values;  // of a first-order scene
  Array x, x_next, x_begin;            // x_begin: of a step that is taken in halves
  Array x_free;  // the end of a step of a method of first order, before contact; else empty
  ContactWork contact_work;
  std::vector<std::unique_ptr<StepCorrection>> corrections;  // applied in this order
  Breaking breaking;                                         // ties that may break
  std::unique_ptr<Sleep> sleep;                              // if the scene asks for it
  std::function<bool()> stop;                                // of long steps
  double t(std::int64_t step) const { return t0 + static_cast<double>(step - n0) * settings->h; }

  void compile_field(const SystemSpec& spec, Registry& registry);
  void compile_particles(const SystemSpec& spec, Registry& registry, Threads threads);
  struct SceneConstraint {
    std::unique_ptr<Constraint> constraint;
    SourceLocation place;
    std::string name;      // of its plugin
    std::vector<int> ids;  // of the elements that it joins
    double feedback;       // 1/s
  };
  std::vector<SceneConstraint> make_constraints(const SystemSpec& spec, Registry& registry) const;
  void compile_constraints(const SystemSpec& spec, std::vector<SceneConstraint> constraints);
  void compile_corrections();  // of forces
  std::unique_ptr<StepCorrection> contact(const ContactSpec& spec, const ContactTask& task,
                                          Registry& registry);
  std::optional<BodyCollisionSpec> body_collision(const SystemSpec& spec) const;
  void compile_contact(const SystemSpec& spec, Registry& registry);
  std::vector<double> masses() const;  // kg, as if none were pinned
  void place_particles();              // x := the initial state
  void apply_switches(const Settings& wanted);

  double& number(std::string_view part, int item, int component) {
    return x[shape.find(part)->at(static_cast<std::size_t>(item),
                                  static_cast<std::size_t>(component))];
  }

  // Makes the integrator of these settings; if the plugin throws, nothing changes. A restart has to
  // come before the next step.
  IntegratorInfo info_of(const Method& method, const SourceLocation& place) const;
  void make_integrator(const Settings& wanted, const SourceLocation& place);
  Error blaming_force(const Error& misfit, const SourceLocation& scene) const;
  // x_next := the corrected step from t; false if a correction fails or the step is given up. One
  // that is too long for a correction is taken in halves, and these likewise.
  bool correct(double t, double h);
  bool step_in_halves(double t, double h, int halvings);  // changes x, too
  StepCorrection::Outcome correct_once(double t, double h, bool may_be_halved);
  // The memory of the integrator before a step that corrections may give up.
  std::vector<double> memory_for_corrections() const {
    return stop && !corrections.empty() ? integrator->memory() : std::vector<double>();
  }
  // Steps of a scene with sleeping islands: up to `most` of the awake ones, at least one, or a
  // single one to another `end`; returns their number.
  int advance_awake(std::int64_t most, std::optional<double> end = {});
  bool some_sleep(double end);  // before a step to `end`: wakes the disturbed ones
  std::int64_t steps_to_look(std::int64_t most) const;
  void look_for_rest(double from);  // after steps
  void begin_awake();
  void wake(int particle);
  // Frames each correction: the accounts of a method of first order, late_work().
  void begin_books();
  double late_books(double t, double h) const;  // J, since then
  // Breaks the ties that the state at the end of a step, x_next, loads beyond their limit.
  void break_ties(double end, double h);
  void set_broken(std::vector<int> broken, double energy);  // with the energy of the new ones, J
  void add_broken_energy(double energy);                    // J
  // Informs users of surfaces. True if the equations of constraints changed, so that steppers have
  // to be made again.
  bool set_torn(const std::vector<int>& broken);
  // Frames a step: the work of contact in it counts up to the reported state.
  void begin_contact(double t);
  void end_contact(double t);
  ImpactEvents* impact_events();  // of a method with steps of its own; null: it has none
  void restart();
  // Steps with these settings from now on; if it throws, nothing changes.
  void adopt(std::shared_ptr<const Settings> wanted);
  // The exception of the next step, of length h, as the error of the plugin that threw it.
  [[noreturn]] void rethrow_in_step(double h);
  // Changes x between two steps. Throws Error{kUsage} if constraints cannot be satisfied then.
  void change(const std::function<void()>& make);
  void check_not_led(int i) const;  // throws Error{kUsage} where it is
  // Finds the reason why the step failed, and the first number of the next state that is not
  // finite; false if all of it is finite.
  bool find_divergence(StepStatus status);
};

// Throws Error{kScene} for a name of springs that is not one line of text.
void check_family(const std::string& name, const SourceLocation& place);

}  // namespace sim
