#include "core/scene/simulation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "core/base/hash.h"
#include "core/base/text.h"
#include "core/geometry/triangle_mesh.h"
#include "core/ode/cut_steps.h"
#include "core/particles/group.h"
#include "core/particles/loads.h"
#include "core/plugin/registered_solvers.h"
#include "core/scene/body_attachments.h"
#include "core/scene/memory_estimate.h"
#include "core/scene/part_text.h"
#include "core/scene/plugin_guard.h"
#include "core/scene/simulation_impl.h"
#include "core/scene/sleep.h"

namespace sim {
namespace {
// Small scenes are faster on one thread: threads wait for each other several times a step, and on a
// busy machine that costs far more than it saves.
constexpr int kParticlesPerThread = 2048;
constexpr int kLeastPerThread = 256;  // if the run tunes the number itself
constexpr std::size_t kOfBody = 4;    // particles more that a body is worth, which may touch others

int useful_threads(Threads threads, int particles, std::size_t bodies) {
  const int each = threads.as_pay ? kLeastPerThread : kParticlesPerThread;
  const std::size_t useful = (static_cast<std::size_t>(particles) + kOfBody * bodies) /
                             static_cast<std::size_t>(each);
  return static_cast<int>(
      std::clamp<std::size_t>(useful, 1, static_cast<std::size_t>(threads.most)));
}

// Scenes from Lua have been checked with their lines; this checks specs made in C++ likewise.
void check(const SystemSpec& spec) {
  const auto refuse = [&](const std::string& why, const SourceLocation& place) {
    throw Error(ErrorKind::kScene, {"scene '" + spec.name + "'", place, why, ""});
  };
  if (spec.particles.has_value() == spec.first_order.has_value())
    refuse("it needs either particles or a first-order state", spec.place);
  if (!spec.particles) return;
  const int n = spec.particles->count();
  const auto outside = [&](int id) { return id < 0 || id >= n; };
  for (const int id : spec.particles->pinned)
    if (outside(id))
      refuse("pinned particle " + std::to_string(id) + " does not exist", spec.place);
  if (!spec.loads.empty() && static_cast<int>(spec.loads.size()) != n)
    refuse("there are " + std::to_string(spec.loads.size()) + " loads", spec.place);
}

void check_surfaces(const PartSpec& part, int n) {
  for (const auto& [name, value] : part.given)
    if (const auto* surface = std::get_if<std::shared_ptr<const TriangleMesh>>(&value))
      if (!*surface || (*surface)->particles() != n)
        throw Error(ErrorKind::kScene,
                    {"bad " + name, part.place, "it is a surface of other particles", ""});
}

// The elements of a force on single particles in a scene with bodies, whose particles are left out.
std::optional<Elements> without_bodies(const PluginInfo& plugin, const PartSpec& part,
                                       const SystemSpec& spec) {
  if (plugin.elements.arity != 1 || spec.bodies.empty()) return {};
  Elements own = part.elements;
  const int first = spec.bodies.front().first, n = spec.particles->count();
  if (own.ids.empty()) {
    own.arity = 1;
    for (int i = 0; i < first; ++i) own.ids.push_back(i);
  }
  std::erase_if(own.ids, [&](int id) { return id >= first && id < n; });
  if (own.ids.empty())
    throw Error(ErrorKind::kScene, {plugin.title(), part.place, "it has no particles",
                                    "those of rigid bodies are not its own: add some"});
  return own;
}

std::map<std::string, std::vector<double>> carried_numbers(const ParticlesSpec& particles) {
  std::map<std::string, std::vector<double>> numbers = particles.numbers;
  std::vector<double>& masses = numbers["m"];
  for (int i = 0; i < particles.count(); ++i) masses.push_back(particles.at(i).mass);
  return numbers;
}

// The force on the particles that its part names.
std::unique_ptr<Force> on_group(std::unique_ptr<Force> force, const PluginInfo& plugin,
                                const PartSpec& part, int n) {
  const std::vector<int>& ids = *part.particles;
  const auto refuse = [&](const std::string& why) {
    throw Error(ErrorKind::kScene, {plugin.title(), part.place, why, ""});
  };
  if (!plugin.pointwise || !part.elements.empty()) refuse("it cannot be kept to some particles");
  if (!std::ranges::is_sorted(ids, std::less_equal{}) ||
      (!ids.empty() && (ids.front() < 0 || ids.back() >= n)))
    refuse("its particles are not ascending ids of the scene");
  return make_group(std::move(force), ids);
}

}  // namespace

// In the order of FirstOrderSpec::state.
void Simulation::Impl::compile_field(const SystemSpec& spec, Registry& registry) {
  const FirstOrderSpec& first = *spec.first_order;
  initial_values = first.state;
  const SourceLocation& place = first.field.place;
  const FieldPlugin& plugin = registry.get<Field>(first.field.plugin, place);
  const Params params(plugin.title(), plugin.params, first.field.given, place, plugin.free_numbers);
  system = at_source(place, [&] {
    return std::make_unique<FieldSystem>(first.state, first.dimension,
                                         made_by(plugin, place, params));
  });
  pool = std::make_unique<ThreadPool>(1);
}

void Simulation::Impl::compile_particles(const SystemSpec& spec, Registry& registry,
                                         Threads threads) {
  initial = *spec.particles;
  const int n = initial.count();
  for (const RigidSpec& body : spec.bodies) bodies.emplace_back(body.shape, body.mass, body.first);
  x = Array(Layout(n).size());
  place_particles();
  std::vector<SceneConstraint> constraints = make_constraints(spec, registry);
  std::vector<std::unique_ptr<Force>> forces;
  std::vector<std::string> names;
  std::vector<Force*> parts;
  std::map<std::string, std::vector<double>> carried;  // lent to one force after the other
  for (const PartSpec& part : spec.forces) {
    const ForcePlugin& plugin = registry.get<Force>(part.plugin, part.place);
    const Params params(plugin.title(), plugin.params, part.given, part.place, plugin.free_numbers);
    std::optional<Elements> own = without_bodies(plugin, part, spec);
    if (plugin.reads_particles) {
      if (!own) own = part.elements;
      if (carried.empty()) carried = carried_numbers(initial);
      own->carried = std::move(carried);
    }
    const BodyAttachments joined(own ? *own : part.elements, spec, bodies, n);
    check_elements(joined.elements, plugin, params, joined.count, part.place);
    check_surfaces(part, n);
    auto force =
        at_source(part.place, [&] { return made_by(plugin, part.place, params, joined.elements); });
    if (plugin.reads_particles) carried = std::move(own->carried);
    for (const auto& [family, count] : force->families()) check_family(family, part.place);
    if (!joined.nodes.empty()) force = force_on_nodes(std::move(force), joined.nodes);
    if (part.particles) force = on_group(std::move(force), plugin, part, n);
    parts.push_back(force.get());
    forces.push_back(std::move(force));
    names.push_back(plugin.name);
    force_switches.push_back(part.switch_name);
    force_places.push_back(part.place);
  }
  if (!spec.loads.empty()) {
    forces.push_back(std::make_unique<Loads>(spec.loads));
    names.push_back("load");
  }
  const auto may_break = [](const auto& part) { return part->breakable() != nullptr; };
  if (std::ranges::any_of(forces, may_break) ||
      std::ranges::any_of(constraints, may_break, &SceneConstraint::constraint))
    for (const auto& force : forces) force->expect_tears();
  pool = std::make_unique<ThreadPool>(useful_threads(threads, n, spec.bodies.size()));
  if (threads.as_pay && pool->most() > 1) thread_count_tuner.emplace(*pool);
  auto compiled = at_source(spec.place, [&] {
    return std::make_unique<ParticleSystem>(masses(), settings->pinned, std::move(forces), x.data(),
                                            *pool);
  });
  particles = compiled.get();
  particles->name_forces(std::move(names));
  particles->set_implicit_solvers(registered_solvers(registry));
  const SceneNames names_in_scene = names_of(spec);
  for (std::size_t k = 0; k < parts.size(); ++k) {
    if (spec.forces[k].stiff) particles->set_stiff(*parts[k], *spec.forces[k].stiff);
    for (std::string& note : notes_of(*parts[k], spec.forces[k], names_in_scene))
      particles->add_note(std::move(note));
  }
  for (const PrescribedSpec& lead : spec.particles->prescribed)
    at_source(lead.place, [&] {
      const Vec3 now = particles->view(0, x.data()).position(lead.particle);
      particles->prescribed().add(lead.particle, now, lead.path);
    });
  if (!spec.particles->prescribed.empty()) particles->set_masses(masses(), settings->pinned);
  for (const PartSpec& part : spec.colliders) {
    const auto& plugin = registry.get<Collider>(part.plugin, part.place);
    const Params params(plugin.title(), plugin.params, part.given, part.place);
    at_source(part.place, [&] {
      particles->add_collider(made_by(plugin, part.place, params), plugin.name, x.data(),
                              bodies.empty() ? n : bodies.front().first());
    });
    collider_switches.push_back(part.switch_name);
  }
  particles->set_accuracy(spec.accuracy);
  compile_corrections();
  compile_constraints(spec, std::move(constraints));
  for (std::size_t k = 0; k < parts.size(); ++k) breaking.add(*parts[k], force_switches[k]);
  const ConstraintSystem* const system_of_constraints = particles->constraint_system();
  breaking.begin(system_of_constraints ? &system_of_constraints->constraints() : nullptr);
  compile_contact(spec, registry);
  apply_switches(*settings);
  system = std::move(compiled);
}

void Simulation::Impl::apply_switches(const Settings& wanted) {
  const auto off_of = [&](const std::vector<std::string>& names) {
    std::vector<std::size_t> off;
    for (std::size_t i = 0; i < names.size(); ++i)
      if (std::ranges::binary_search(wanted.off, names[i])) off.push_back(i);
    return off;
  };
  particles->set_off(off_of(force_switches), off_of(collider_switches));
}

std::vector<double> Simulation::Impl::masses() const {
  std::vector<double> list(static_cast<std::size_t>(initial.count()));
  for (std::size_t i = 0; i < list.size(); ++i) list[i] = initial.at(static_cast<int>(i)).mass;
  return list;
}

IntegratorInfo Simulation::Impl::info_of(const Method& method, const SourceLocation& place) const {
  const FloatControl control;
  try {
    return method.make()->info();
  } catch (const Error&) {
    throw;
  } catch (...) {
    rethrow_from_plugin(method.plugin().title() + " of " + method.plugin().file, place,
                        "while it was made");
  }
}

void Simulation::Impl::make_integrator(const Settings& wanted, const SourceLocation& place) {
  const FloatControl control;
  const PluginInfo& plugin = wanted.method.plugin();
  try {
    auto method = wanted.method.make();
    const IntegratorInfo info = method->info();
    if (particles) particles->set_changed_between_steps(!corrections.empty());
    if (particles && !info.adaptive && particles->cuts_steps(info.implicit, info.order))
      method = std::make_unique<CutSteps>(std::move(method));
    method->prepare(*system);
    method->set_step_size(wanted.h);
    if (!corrections.empty() && method->info().adaptive) {
      const std::string without = corrections.back()->remedy();
      throw Error(ErrorKind::kScene,
                  {"integrator does not fit", place,
                   "this scene has " + corrections.back()->title() +
                       ", which acts between steps, and an adaptive method does not end its steps "
                       "there",
                   "use verlet, rk4 or another method of fixed steps" +
                       (without.empty() ? "" : ", or " + without)});
    }
    x_begin = Array(corrections.empty() ? 0 : system->size());
    x_free = Array(corrections.empty() || method->info().order != 1 ? 0 : system->size());
    integrator = std::move(method);
  } catch (const Error& error) {
    throw blaming_force(error, place);
  } catch (...) {
    rethrow_from_plugin(plugin.title() + " of " + plugin.file, place, "while it was made");
  }
}

// A position of -0 becomes 0, for adding 0 to it would change its bits.
void Simulation::Impl::place_particles() {
  const int n = initial.count();
  const Layout layout(n);
  for (int i = 0; i < n; ++i) {
    const ParticleSpec particle = initial.at(i);
    for (int axis = 0; axis < 3; ++axis) {
      layout.block(x.data(), axis)[i] = particle.position[axis] + 0.0;
      layout.block(x.data(), 3 + axis)[i] = particle.velocity[axis] + 0.0;
    }
  }
  if (particles) particles->start_internal(x.data());
  for (const int i : settings->pinned)
    for (int axis = 0; axis < 3; ++axis) layout.block(x.data(), 3 + axis)[i] = 0;
  if (particles) particles->prescribed().place(0, layout.axes(x.data()), layout.axes(x.data(), 3));
  const bool complete = system && x.size() == system->size();
  if (complete && particles && particles->constraint_system())
    particles->constraint_system()->start(x.data());
}

Simulation::Simulation(const SystemSpec& spec, Registry& registry, const RunOptions& options)
    : impl_(std::make_unique<Impl>()) {
  check(spec);
  Impl& s = *impl_;
  s.name = spec.name;
  s.duration = spec.duration;
  const double h = options.dt > 0 ? options.dt : spec.dt;
  if (!(h > 0) || !std::isfinite(h))
    throw Error(ErrorKind::kScene, {"scene '" + spec.name + "'", spec.place,
                                    "its step size dt is " + shortest(h), "give dt > 0 in s"});
  const auto settings = std::make_shared<Settings>(
      Settings{Method(registry, options.integrator.over(spec.integrator), spec.place), h, {}, {}});
  s.settings = settings;
  for (const std::vector<PartSpec>* parts : {&spec.forces, &spec.colliders})
    for (const PartSpec& part : *parts)
      if (!part.switch_name.empty() && !part.on) settings->off.push_back(part.switch_name);
  std::ranges::sort(settings->off);

  require_room(spec, s.info_of(settings->method, spec.place), registry);
  if (spec.particles) {
    settings->pinned = spec.particles->pinned;
    std::ranges::sort(settings->pinned);
    const auto repeated = std::unique(settings->pinned.begin(), settings->pinned.end());
    settings->pinned.erase(repeated, settings->pinned.end());
    s.compile_particles(spec, registry, options.threads);
  } else {
    s.compile_field(spec, registry);
  }
  s.pool->serve(s.system->cancellation());
  s.shape = s.system->shape();
  s.x = Array(s.system->size());
  s.x_next = Array(s.system->size());
  s.make_integrator(*settings, spec.place);
  if (spec.sleep) {
    if (!s.particles)
      throw Error(ErrorKind::kScene, {"sleep does not fit", spec.place,
                                      "a first-order scene has no particles that rest", ""});
    s.sleep = std::make_unique<Sleep>(spec, registry, options.threads, *s.particles);
  }
  reset();
}

Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;

bool Simulation::step() { return steps(1) == 1; }

int Simulation::steps(std::int64_t most) {
  Impl& s = *impl_;
  const double from = t();
  if (s.sleep) most = s.steps_to_look(most);
  if (s.some_sleep(s.t(s.step_count + 1))) return s.advance_awake(most);
  if (s.thread_count_tuner) s.thread_count_tuner->begin();
  s.begin_contact(t());
  if (!s.corrections.empty() || s.breaking.any()) most = 1;
  const FloatControl control;
  const Cancellation::Step step(s.system->cancellation());
  const std::vector<double> before = s.memory_for_corrections();
  Advance now;
  try {
    now = s.integrator->advance(*s.system, t(), h(), most, s.x.data(), s.x_next.data());
  } catch (...) {
    s.rethrow_in_step(h());
  }
  if (now.status != StepStatus::kDone) {
    if (s.find_divergence(now.status)) {
      if (now.status != StepStatus::kStopped) s.restart();
      return 0;
    }
    now.taken = 1;
  }
  if (!s.correct(t(), h())) {
    s.restart();
    if (!before.empty() && s.divergence.status == StepStatus::kStopped)
      s.integrator->recall(before);
    return 0;
  }
  const double end = s.t(s.step_count + now.taken);
  s.end_contact(end);
  s.break_ties(end, h());
  std::swap(s.x, s.x_next);
  s.step_count += now.taken;
  if (s.thread_count_tuner) s.thread_count_tuner->end(now.taken);
  s.look_for_rest(from);
  return now.taken;
}

// A method with adaptive steps gives any time between them by dense output; the others restart.
bool Simulation::step_to(double end) {
  Impl& s = *impl_;
  const double short_h = end - t();
  const bool adaptive = integrator_info().adaptive;
  const double from = t();
  if (s.some_sleep(end)) return s.advance_awake(1, end) == 1;
  s.begin_contact(t());
  const FloatControl control;
  const Cancellation::Step step(s.system->cancellation());
  StepStatus status = StepStatus::kDone;
  try {
    if (!adaptive) s.integrator->restart(t(), short_h, s.x.data());
    status = s.integrator->step(*s.system, t(), short_h, s.x.data(), s.x_next.data());
  } catch (...) {
    if (!adaptive) s.restart();
    s.rethrow_in_step(short_h);
  }
  if (status != StepStatus::kDone && s.find_divergence(status)) {
    if (!adaptive || status != StepStatus::kStopped) s.restart();
    return false;
  }
  if (!s.correct(t(), short_h)) {
    s.restart();
    return false;
  }
  s.end_contact(end);
  s.break_ties(end, short_h);
  std::swap(s.x, s.x_next);
  s.n0 = ++s.step_count;
  s.t0 = end;
  if (!adaptive) s.restart();
  s.look_for_rest(from);
  return true;
}

void Simulation::stop_when(std::function<bool()> stop) {
  impl_->stop = stop;
  if (impl_->sleep) impl_->sleep->forget_scene();
  impl_->system->stop_when(std::move(stop));
}

void Simulation::reset() {
  if (!impl_->settings->held.empty() || !impl_->settings->broken.empty()) {
    auto wanted = std::make_shared<Settings>(*impl_->settings);
    wanted->held.clear();
    wanted->broken.clear();
    wanted->broken_energy = 0;
    impl_->adopt(std::move(wanted));
  }
  impl_->step_count = impl_->n0 = 0;
  impl_->t0 = 0;
  for (const auto& correction : impl_->corrections) correction->reset();
  if (impl_->sleep) impl_->sleep->reset();
  if (impl_->particles)
    impl_->place_particles();
  else
    std::ranges::copy(impl_->initial_values, impl_->x.data());
  impl_->restart();
}

const Divergence& Simulation::divergence() const { return impl_->divergence; }
double Simulation::t() const { return impl_->t(impl_->step_count); }
double Simulation::t(std::int64_t step) const { return impl_->t(step); }
double Simulation::h() const { return impl_->settings->h; }
std::int64_t Simulation::step_count() const { return impl_->step_count; }

std::int64_t Simulation::steps_for(double duration) const {
  // The quotient may miss a whole number by a rounding error: 0.3 / 0.1 is 2.9999999999999996.
  const double quotient = (duration - impl_->t0) / h();
  const double slack = std::max(std::min(1e-12 * quotient, 1e-3), 4e-16 * quotient);
  const double steps = std::ceil(quotient - slack);
  constexpr double kMost = 9e18;
  return impl_->n0 + static_cast<std::int64_t>(std::clamp(steps, 0.0, kMost));
}

const std::string& Simulation::name() const { return impl_->name; }
double Simulation::duration() const { return impl_->duration; }
const Method& Simulation::method() const { return impl_->settings->method; }
IntegratorInfo Simulation::integrator_info() const { return impl_->integrator->info(); }
const Integrator& Simulation::integrator() const { return *impl_->integrator; }
OdeSystem& Simulation::ode() { return *impl_->system; }
const OdeSystem& Simulation::ode() const { return *impl_->system; }
std::span<const double> Simulation::state() const { return impl_->x.span(); }

const StateShape& Simulation::shape() const { return impl_->shape; }
bool Simulation::second_order() const { return impl_->particles != nullptr; }
bool Simulation::flat() const { return shape().first().components.size() == 1; }
int Simulation::particles() const { return flat() ? 0 : static_cast<int>(shape().first().count); }

int Simulation::threads() const { return impl_->pool ? impl_->pool->size() : 1; }

int Simulation::pinned_count() const {
  return impl_->particles ? impl_->particles->pinned_count() : 0;
}

Vec3 Simulation::position(int i) const {
  if (!impl_->particles) return {component(3 * i), component(3 * i + 1), component(3 * i + 2)};
  return impl_->particles->view(t(), impl_->x.data()).position(i);
}

Vec3 Simulation::velocity(int i) const {
  if (!impl_->particles) return Vec3::Zero();
  return impl_->particles->view(t(), impl_->x.data()).velocity(i);
}

int Simulation::components() const { return static_cast<int>(impl_->x.size()); }
double Simulation::component(int i) const { return impl_->x[static_cast<std::size_t>(i)]; }

bool Simulation::conserves_energy() const {
  return impl_->particles && impl_->corrections.empty() && !breaks() &&
         impl_->particles->conserves_energy() &&
         !(constraint_system() && constraint_system()->constraints().move());
}

Energy Simulation::energy() const {
  if (!impl_->particles) return {};
  return {impl_->particles->kinetic_energy(t(), impl_->x.data()),
          impl_->particles->potential_energy(t(), impl_->x.data())};
}

std::uint64_t Simulation::hash() const {
  StateHash hash;
  hash.add(static_cast<std::uint64_t>(impl_->step_count));
  for (const auto& [begin, end] : impl_->shape.ranges())
    hash.add(impl_->x.span().subspan(begin, end - begin));
  return hash.value();
}

}  // namespace sim
