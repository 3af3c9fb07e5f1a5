// Scenes, their steps and their state.
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "core/base/text.h"
#include "core/c/handles.h"
#include "core/lua/scene/scene_file.h"
#include "core/output/format.h"
#include "core/particles/constraints/constraint_system.h"
#include "core/report/plugin_json.h"

using namespace sim;
using namespace sim::c;

namespace {

std::string system_json(const SystemSpec& spec, const Simulation& system) {
  JsonObject object, switches;
  object.text("name", system.name()).integer("order_of_state", system.second_order() ? 2 : 1);
  if (system.flat())
    object.integer("components", system.components());
  else
    object.integer("particles", system.particles()).integer("pinned", system.pinned_count());
  for (const auto& [name, on] : system.switches()) switches.flag(name, on);
  std::vector<std::string> observed;
  for (const ObserverSpec& observer : spec.observers)
    observed.push_back(json_string(observer.name));
  return object.json("switches", switches.str())
      .json("observed", json_array(observed))
      .text("integrator", system.method().name())
      .number("dt", system.h())
      .number("duration", system.duration())
      .str();
}

const StatePart& part_of_state(const Simulation& system, const char* name) {
  if (const StatePart* const part = system.shape().find(checked_text(name, "name"))) return *part;
  std::vector<std::string> known;
  for (const StatePart& part : system.shape().parts()) known.push_back(part.name);
  refuse("no such part of the state", name, "the system has none of this name",
         suggestion(name, known));
}

std::size_t components_of(const StatePart& part) {
  return std::max<std::size_t>(1, part.components.size());
}

void check_particle(const Simulation& system, int particle) {
  if (particle < 0 || particle >= system.particles())
    refuse("no such particle", std::to_string(particle),
           "there are " + std::to_string(system.particles()), "ids count from 0");
}

Vec3 vector_of(const double* numbers, const char* name) {
  if (!numbers) refuse("null vector", name, "three numbers are wanted", "give them");
  return {numbers[0], numbers[1], numbers[2]};
}

// A change of one system between two steps: the action that action_of() makes.
template <class ActionOf>
int changed(sim_scene* scene, int system, sim_error* error, ActionOf action_of,
            const char* function = __builtin_FUNCTION()) noexcept {
  const auto work = [&] {
    const InCall call(scene);
    Simulation& one = system_of(scene, system);
    ++scene->generation;
    const Action action = action_of(one);
    apply(one, action);
    if (scene->record) scene->record->action(static_cast<std::size_t>(system), action);
  };
  return guarded(error, work, function);
}

// A fact of one system; `none` for what is not there, and for a scene that is in a call.
template <class Fact, class Get>
Fact fact(const sim_scene* scene, int system, Fact none, Get get) noexcept {
  Fact found = none;
  guarded(nullptr, [&] {
    const InCall call(scene);
    found = get(system_of(scene, system));
  });
  return found;
}

sim_scene* open_scene(const char* name, const char* text, const sim_options* options,
                      sim_watch watch = nullptr, void* user = nullptr) {
  Watcher watcher(watch, user);
  return opened(checked_text(name, "name"), text, asked_of(options), watcher).release();
}

}  // namespace

extern "C" {

int sim_interface_version(void) { return SIM_MAJOR * 1000 + SIM_MINOR; }

const char* sim_version(void) { return SIM_VERSION; }

void sim_free(void* block) { std::free(block); }

sim_scene* sim_open(const char* name, const sim_options* options, sim_error* error) {
  return guarded_pointer(error, [&] { return open_scene(name, nullptr, options); });
}

sim_scene* sim_open_text(const char* text, const char* name, const sim_options* options,
                         sim_error* error) {
  return guarded_pointer(error,
                         [&] { return open_scene(name, checked_text(text, "text"), options); });
}

sim_scene* sim_open_watched(const char* name, const char* text, const sim_options* options,
                            sim_watch watch, void* user, sim_error* error) {
  return guarded_pointer(error, [&] { return open_scene(name, text, options, watch, user); });
}

sim_scene* sim_open_field(sim_field field, void* user, const double* x0, size_t n, double duration,
                          const sim_options* options, sim_error* error) {
  return guarded_pointer(error, [&]() -> sim_scene* {
    if (!field || !x0 || n == 0)
      refuse("no field", "field, x0, n", "a function and at least one number are wanted",
             "give both");
    for (std::size_t i = 0; i < n; ++i)
      if (!std::isfinite(x0[i]))
        refuse("bad value", "x0[" + std::to_string(i) + "]", "it is not finite",
               "give finite numbers");
    auto scene = std::make_unique<sim_scene>();
    const Asked& asked = scene->asked = asked_of(options);
    if (asked.variant.dt <= 0 || !(duration >= 0 && duration < HUGE_VAL))
      refuse("no step", "dt, duration", "a field has none of its own", "give both in s");
    scene->registry = registry_of(asked, environment_of(asked));
    SystemSpec& spec = scene->loaded.spec.systems.emplace_back();
    scene->name = scene->loaded.spec.file = spec.name = "field";
    spec.dt = asked.variant.dt;
    spec.duration = duration;
    spec.one_thread = true;
    spec.integrator = MethodChoice("rk4");
    FirstOrderSpec& first = spec.first_order.emplace();
    first.dimension = 1;
    first.state.assign(x0, x0 + n);
    first.field.plugin = "lua";  // a field that is a function of a scene
    first.field.given["f"] =
        OdeFunction([field, user, stopped = scene->field_stopped](
                        double t, std::span<const double> x, std::span<double> dxdt) {
          if (field(user, t, x.data(), dxdt.data(), x.size()) == 0) return;
          *stopped = true;
          refuse("stopped", "field", "it asked for that", "");
        });
    stoppable(*scene, [&] {
      scene->loaded.systems.emplace_back(spec, *scene->registry,
                                         run_options(asked.variant, asked, spec, *scene->registry));
    });
    listen(*scene);
    return scene.release();
  });
}

void sim_close(sim_scene* scene) { c::close(scene); }

int sim_systems(const sim_scene* scene) {
  return scene ? static_cast<int>(scene->loaded.systems.size()) : 0;
}

char* sim_describe(const sim_scene* scene, sim_error* error) {
  return guarded_pointer(error, [&] {
    const InCall call(scene);
    std::vector<std::string> systems, args;
    const StudiedScene& loaded = scene->loaded;
    for (std::size_t i = 0; i < loaded.systems.size(); ++i)
      systems.push_back(system_json(loaded.spec.systems[i], loaded.systems[i]));
    for (const SceneArg& arg : scene->loaded.spec.args)
      args.push_back(JsonObject()
                         .text("name", arg.name)
                         .text("default", to_text(arg.default_value))
                         .text("value", to_text(arg.value))
                         .text("doc", arg.doc)
                         .str());
    return given_away(JsonObject()
                          .json("systems", json_array(systems))
                          .json("args", json_array(args))
                          .text("file", scene->loaded.spec.file)
                          .str());
  });
}

char* sim_describe_plugins(const char* name, const sim_options* options, sim_error* error) {
  return guarded_pointer(error, [&] {
    const Asked asked = asked_of(options);
    const auto registry = registry_of(asked, environment_of(asked));
    std::vector<std::string> found;
    for (const PluginKind& kind : kPluginKinds) {
      for (const std::string& each : registry->names(kind))
        if (!name) found.push_back(report::plugin_json(registry->get(kind, each), *registry).str());
    }
    if (name)
      for (const PluginInfo* info : registry->find(name))
        found.push_back(report::plugin_json(*info, *registry).str());
    if (name && found.empty())
      refuse("unknown plugin", name, "there is none of this name", "a null name lists all");
    return given_away(json_array(found));
  });
}

char* sim_scenes(sim_error* error) {
  return guarded_pointer(error, [&] {
    std::vector<std::string> names;
    for (const std::string& name : list_scenes(environment_of(Asked()).scene_folders))
      names.push_back(json_string(name));
    return given_away(json_array(names));
  });
}

int sim_reset(sim_scene* scene, sim_error* error) {
  return guarded(error, [&] {
    const InCall call(scene);
    ++scene->generation;
    if (scene->record) scene->record->reset();
    for (Simulation& system : scene->loaded.systems) system.reset();
  });
}

double sim_time(const sim_scene* scene, int system) {
  return fact(scene, system, std::nan(""), [](const Simulation& one) { return one.t(); });
}

double sim_step_size(const sim_scene* scene, int system) {
  return fact(scene, system, std::nan(""), [](const Simulation& one) { return one.h(); });
}

double sim_duration(const sim_scene* scene, int system) {
  return fact(scene, system, std::nan(""), [](const Simulation& one) { return one.duration(); });
}

int64_t sim_step_count(const sim_scene* scene, int system) {
  return fact(scene, system, std::int64_t{-1},
              [](const Simulation& one) { return one.step_count(); });
}

uint64_t sim_generation(const sim_scene* scene) {
  return fact(scene, 0, std::uint64_t{0}, [&](const Simulation&) { return scene->generation; });
}

sim_snapshot* sim_snapshot_take(const sim_scene* scene, sim_error* error) {
  return guarded_pointer(error, [&] {
    const InCall call(scene);
    auto snapshot = std::make_unique<sim_snapshot>();
    snapshot->scene = scene->self;
    for (const Simulation& system : scene->loaded.systems)
      snapshot->systems.push_back(system.snapshot());
    return snapshot.release();
  });
}

int sim_snapshot_restore(sim_scene* scene, const sim_snapshot* snapshot, sim_error* error) {
  return guarded(error, [&] {
    const InCall call(scene);
    if (checked(snapshot, "snapshot").scene != scene->self)
      refuse("another scene's snapshot", "snapshot", "it was not taken of this handle",
             "restore it there");
    refuse_in_record(*scene, "snapshot_restore");
    ++scene->generation;
    for (std::size_t i = 0; i < snapshot->systems.size(); ++i)
      scene->loaded.systems[i].restore(snapshot->systems[i]);
  });
}

void sim_snapshot_free(sim_snapshot* snapshot) { delete snapshot; }

int sim_state(const sim_scene* scene, int system, const char* name, sim_part* part,
              sim_error* error) {
  return guarded(error, [&] {
    const InCall call(scene);
    const Simulation& one = system_of(scene, system);
    const StatePart& found = part_of_state(one, name);
    checked(part, "part") = {
        one.state().data() + found.begin, found.count,      components_of(found), found.item_stride,
        found.component_stride,           scene->generation};
  });
}

char* sim_state_parts(const sim_scene* scene, int system, sim_error* error) {
  return guarded_pointer(error, [&] {
    const InCall call(scene);
    std::vector<std::string> names;
    for (const StatePart& part : system_of(scene, system).shape().parts())
      names.push_back(json_string(part.name));
    return given_away(json_array(names));
  });
}

int sim_copy_state(const sim_scene* scene, int system, const char* name, double* out, size_t size,
                   sim_error* error) {
  return guarded(error, [&] {
    const InCall call(scene);
    const Simulation& one = system_of(scene, system);
    const StatePart& part = part_of_state(one, name);
    const std::size_t components = components_of(part);
    if (!out || size < part.count * components)
      refuse("no room", name, "it has " + std::to_string(part.count * components) + " numbers",
             "give room for all");
    const double* const from = one.state().data() + part.begin;
    for (std::size_t i = 0; i < part.count; ++i)
      for (std::size_t c = 0; c < components; ++c)
        out[i * components + c] = from[i * part.item_stride + c * part.component_stride];
  });
}

int sim_energy(const sim_scene* scene, int system, sim_energies* energies, sim_error* error) {
  return guarded(error, [&] {
    const InCall call(scene);
    const Simulation& one = system_of(scene, system);
    if (!one.second_order())
      refuse("no energy", one.name(), "a first-order system has none", "ask a system of particles");
    const Energy energy = one.energy();
    checked(energies, "energies") = {energy.kinetic, energy.potential};
  });
}

int sim_observe(const sim_scene* scene, int system, const char* name, double* value,
                sim_error* error) {
  return guarded(error, [&] {
    const InCall call(scene);
    const Simulation& one = system_of(scene, system);
    const study::Quantity quantity(scene->loaded.spec.systems[static_cast<std::size_t>(system)],
                                   checked_text(name, "name"));
    if (quantity.is_figure())
      refuse("not of a moment", name, "it is a figure of a whole run",
             "name the quantity alone, or see the report of a run");
    checked(value, "value") = quantity.at(one);
  });
}

char* sim_tensions(const sim_scene* scene, int system, sim_error* error) {
  return guarded_pointer(error, [&] {
    const InCall call(scene);
    const Simulation& one = system_of(scene, system);
    std::vector<std::string> forces;
    if (ConstraintSystem* const constraints = one.constraint_system())
      for (const ConstraintForce& each : constraints->forces(one.t(), one.state().data()))
        forces.push_back(JsonObject()
                             .text("constraint", each.constraint)
                             .integer("a", each.a)
                             .integer("b", each.b)
                             .number("tension", each.tension)
                             .json("force", "[" + shortest(each.force.x()) + "," +
                                                shortest(each.force.y()) + "," +
                                                shortest(each.force.z()) + "]")
                             .str());
    return given_away(json_array(forces));
  });
}

uint64_t sim_hash(const sim_scene* scene, int system) {
  return fact(scene, system, std::uint64_t{0}, [](const Simulation& one) { return one.hash(); });
}

int sim_springs(const sim_scene* scene, int system, int particle, sim_spring* springs, size_t room,
                size_t* count, sim_error* error) {
  return guarded(error, [&] {
    const InCall call(scene);
    const Simulation& one = system_of(scene, system);
    check_particle(one, particle);
    const std::vector<Link> links = one.second_order() ? one.links(particle) : std::vector<Link>();
    if (count) *count = links.size();
    for (std::size_t i = 0; springs && i < std::min(room, links.size()); ++i) {
      const Link& link = links[i];
      const double length = (one.position(particle) - one.position(link.to)).stableNorm();
      springs[i] = {link.to, link.stiffness, link.rest, length, link.tension(length), {}};
      std::strncpy(springs[i].family, link.family.c_str(), sizeof springs[i].family - 1);
    }
  });
}

int sim_set_position(sim_scene* scene, int system, int particle, const double x[3],
                     sim_error* error) {
  return changed(scene, system, error, [&](const Simulation&) {
    return Action{.what = Action::What::kPosition, .particle = particle, .x = vector_of(x, "x")};
  });
}

int sim_set_velocity(sim_scene* scene, int system, int particle, const double v[3],
                     sim_error* error) {
  return changed(scene, system, error, [&](const Simulation&) {
    return Action{.what = Action::What::kVelocity, .particle = particle, .x = vector_of(v, "v")};
  });
}

int sim_set_component(sim_scene* scene, int system, int component, double value, sim_error* error) {
  return changed(scene, system, error, [&](const Simulation& one) {
    const int count = one.flat() ? static_cast<int>(one.components()) : 0;
    if (component < 0 || component >= count)
      refuse("no such component", std::to_string(component),
             "the state has " + std::to_string(count) + " numbers of its own",
             count > 0 ? "they count from 0" : "set positions and velocities");
    return Action{.what = Action::What::kComponent, .particle = component, .value = value};
  });
}

int sim_set_pinned(sim_scene* scene, int system, int particle, int pinned, sim_error* error) {
  return changed(scene, system, error, [&](const Simulation&) {
    return Action{.what = pinned != 0 ? Action::What::kPin : Action::What::kUnpin,
                  .particle = particle};
  });
}

int sim_set_switch(sim_scene* scene, int system, const char* name, int on, sim_error* error) {
  return changed(scene, system, error, [&](const Simulation&) {
    return Action{.what = Action::What::kSwitch, .on = on != 0, .name = checked_text(name, "name")};
  });
}

int sim_set_dt(sim_scene* scene, int system, double dt, sim_error* error) {
  return changed(scene, system, error,
                 [&](const Simulation&) { return Action{.what = Action::What::kDt, .value = dt}; });
}

int sim_set_integrator(sim_scene* scene, int system, const char* integrator, sim_error* error) {
  return changed(scene, system, error, [&](const Simulation&) {
    Action action{.what = Action::What::kIntegrator,
                  .name = checked_text(integrator, "integrator")};
    action.method = report::method_of(action, *scene->registry);
    return action;
  });
}

int sim_cut(sim_scene* scene, int system, int a, int b, sim_error* error) {
  return changed(scene, system, error, [&](const Simulation&) {
    return Action{.what = Action::What::kCut, .particle = a, .other = b};
  });
}

}  // extern "C"
