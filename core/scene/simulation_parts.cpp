// Parts of a simulation that act between and after its steps: constraints, bodies, contact.
#include <algorithm>
#include <set>

#include "core/base/finite.h"
#include "core/particles/contact_task.h"
#include "core/particles/impact_events.h"
#include "core/particles/late_velocities.h"
#include "core/particles/rigid/rigid_rows.h"
#include "core/scene/body_attachments.h"
#include "core/scene/plugin_guard.h"
#include "core/scene/simulation_impl.h"
#include "core/scene/sleep.h"

namespace sim {

void Simulation::Impl::compile_corrections() {
  for (Force* const force : particles->forces())
    if (auto correction = force->correction(*particles))
      corrections.push_back(std::move(correction));
}

std::vector<Simulation::Impl::SceneConstraint> Simulation::Impl::make_constraints(
    const SystemSpec& spec, Registry& registry) const {
  std::vector<SceneConstraint> all;
  for (const PartSpec& part : spec.constraints) {
    const auto& plugin = registry.get<Constraint>(part.plugin, part.place);
    const Params params(plugin.title(), plugin.params, part.given, part.place);
    const BodyAttachments joined(part.elements, spec, bodies, initial.count());
    check_elements(joined.elements, plugin, params, joined.count, part.place);
    if (part.elements.empty())
      throw Error(ErrorKind::kScene, {plugin.title(), part.place, "it joins nothing",
                                      plugin.elements.arity == 1 ? "give particles = { ids }"
                                                                 : "give ties = { {a, b}, ... }"});
    at_source(part.place, [&] {
      std::unique_ptr<Constraint> constraint = made(plugin.make(params, joined.elements), plugin);
      if (!joined.nodes.empty())
        constraint = constraint_on_nodes(std::move(constraint), joined.nodes);
      all.push_back({std::move(constraint),
                     part.place,
                     plugin.name,
                     {joined.elements.ids.begin(), joined.elements.ids.end()},
                     params.has("feedback") ? params.number("feedback") : 0.0});
    });
  }
  return all;
}

void Simulation::Impl::compile_constraints(const SystemSpec& spec,
                                           std::vector<SceneConstraint> constraints) {
  if (!bodies.empty())
    particles->add_constraint_system().add(std::make_unique<RigidRows>(bodies, particles->pool()),
                                           "rigid", spec.bodies.front().place, 0, x.data());
  for (SceneConstraint& each : constraints) {
    for (const auto& correction : corrections)
      for (const int id : each.ids)
        if (id < initial.count() && correction->breaks_constraints(id))
          throw Error(ErrorKind::kScene,
                      {"constraint", each.place,
                       "particle " + std::to_string(id) + " is of " + correction->title() +
                           ", which would break it",
                       "leave it out of one of them, or " + correction->remedy()});
    at_source(each.place, [&] {
      particles->add_constraint_system().add(std::move(each.constraint), each.name, each.place,
                                             each.feedback, x.data());
    });
  }
  if (!particles->constraint_system()) return;
  particles->constraint_system()->begin();
  if (spec.colliders.empty() || spec.constraints.empty()) return;
  particles->constraint_system()->join_contact(bodies.empty() ? initial.count()
                                                              : bodies.front().first());
}

std::unique_ptr<StepCorrection> Simulation::Impl::contact(const ContactSpec& spec,
                                                          const ContactTask& task,
                                                          Registry& registry) {
  const auto& plugin = registry.get<StepCorrection>(spec.plugin, spec.place);
  const Params params(plugin.title(), plugin.params, spec.given, spec.place);
  return at_source(spec.place, [&] { return made_by(plugin, spec.place, params, task); });
}

namespace {

// Finds the bodies, particles and other bodies that a part joins.
void find_tied(const PartSpec& part, const SystemSpec& spec, int n, bool bodies_too,
               BodyCollisionSpec& collision) {
  const std::vector<int>& ids = part.elements.ids;
  const auto arity = static_cast<std::size_t>(std::max(1, part.elements.arity));
  const auto body_of = [&](int id) { return spec.points[static_cast<std::size_t>(id - n)].body; };
  for (std::size_t k = 0; k + arity <= ids.size(); k += arity)
    for (const int point : std::span(ids).subspan(k, arity))
      for (const int other : std::span(ids).subspan(k, arity)) {
        if (point < n) continue;
        if (other < n)
          collision.tied.emplace(body_of(point), other);
        else if (bodies_too && body_of(point) != body_of(other))
          collision.joined.insert(std::minmax(body_of(point), body_of(other)));
      }
}

}  // namespace

// The collision spec of bodies with colliders, each other and single particles, but not with parts
// joined to them. Empty if nothing can collide.
std::optional<BodyCollisionSpec> Simulation::Impl::body_collision(const SystemSpec& spec) const {
  if (bodies.empty()) return {};
  BodyCollisionSpec collision{.bodies = bodies, .singles = bodies.front().first()};
  for (const RigidSpec& body : spec.bodies) {
    collision.surfaces.push_back(body.surface);
    collision.touches.push_back(body.touches);
  }
  if (spec.contact && !spec.contact->surfaces.empty()) {
    collision.left_out.resize(static_cast<std::size_t>(collision.singles));
    for (const auto& surface : spec.contact->surfaces)
      for (const int i : surface->ids())
        if (i < collision.singles) collision.left_out[static_cast<std::size_t>(i)] = true;
  }
  for (const PartSpec& force : spec.forces)
    find_tied(force, spec, initial.count(), false, collision);
  for (const PartSpec& part : spec.constraints)
    find_tied(part, spec, initial.count(), true, collision);
  const auto touching = std::ranges::count(collision.touches, true);
  const std::int64_t all = touching * collision.singles;
  const bool others = all > static_cast<std::int64_t>(collision.tied.size());
  if (touching == 0 || (touching == 1 && spec.colliders.empty() && !others)) return {};
  return collision;
}

// Surfaces come last: they keep out of the bodies in their final state. A contact without surfaces
// is that of the bodies.
void Simulation::Impl::compile_contact(const SystemSpec& spec, Registry& registry) {
  std::unique_ptr<StepCorrection> surfaces;
  const bool of_bodies = spec.contact && spec.contact->surfaces.empty() && !spec.bodies.empty();
  if (spec.contact && !of_bodies)
    surfaces = contact(*spec.contact,
                       {.particles = *particles,
                        .constraint_system = particles->constraint_system(),
                        .initial = x.data(),
                        .surfaces = spec.contact->surfaces},
                       registry);
  particles->order_by(particles->view(0, x.data()));
  if (auto collision = body_collision(spec))
    corrections.push_back(contact(
        of_bodies ? *spec.contact
                  : ContactSpec{.plugin = spec.body_contact, .place = spec.bodies.front().place},
        {.particles = *particles,
         .constraint_system = spec.constraints.empty() ? nullptr : particles->constraint_system(),
         .initial = x.data(),
         .bodies = std::move(*collision)},
        registry));
  if (surfaces) corrections.push_back(std::move(surfaces));
  for (const auto& one : corrections)
    for (const auto& other : corrections)
      if (one != other && one->bodies()) other->keep_out_of(*one->bodies(), x.data());
  for (const auto& correction : corrections)
    for (std::string& note : correction->notes()) particles->add_note(std::move(note));
  if (breaking.of_constraints() > 0 && !corrections.empty())
    particles->add_note(
        "what bodies and surfaces press with is not in the tension by which rods break");
}

void Simulation::Impl::break_ties(double end, double h) {
  if (!breaking.any()) return;
  const ParticleView view = particles->view(end, x_next.data());
  std::span<const double> multipliers;
  if (breaking.of_constraints() > 0)
    multipliers = particles->constraint_system()->multipliers(end, x_next.data());
  const std::vector<int> more = breaking.overloaded(view, multipliers, settings->off);
  if (more.empty()) return;
  std::vector<int> broken = settings->broken, fresh;
  broken.insert(broken.end(), more.begin(), more.end());
  broken = breaking.with_bridges(std::move(broken));
  std::ranges::set_difference(broken, settings->broken, std::back_inserter(fresh));
  // Other forces across the tear go with it, such as bending.
  const auto of_others = [&] { return particles->unbreakable_energy(end, x_next.data()); };
  const double before = of_others(), in_ties = breaking.energy(view, fresh);
  set_broken(std::move(broken), in_ties);
  if (const double after = of_others(); after != before) add_broken_energy(before - after);
  integrator->restart(end, h, x_next.data());
}

void Simulation::Impl::add_broken_energy(double energy) {
  auto wanted = std::make_shared<Settings>(*settings);
  wanted->broken_energy += energy;
  settings = std::move(wanted);
}

void Simulation::Impl::set_broken(std::vector<int> broken, double energy) {
  auto wanted = std::make_shared<Settings>(*settings);
  wanted->broken_energy += energy;
  wanted->broken = std::move(broken);
  settings = std::move(wanted);
  if (set_torn(settings->broken)) make_integrator(*settings, {});
}

bool Simulation::Impl::set_torn(const std::vector<int>& broken) {
  const bool other_equations = breaking.set_broken(broken);
  if (other_equations) particles->refresh_constraints();
  for (const auto& correction : corrections) correction->tear(breaking.torn());
  return other_equations;
}

int Simulation::breakable_ties() const { return impl_->breaking.count(); }
int Simulation::breakable_springs() const { return impl_->breaking.of_forces(); }
std::span<const std::array<int, 2>> Simulation::torn() const { return impl_->breaking.torn(); }

void Simulation::Impl::begin_books() {
  if (x_free.size() > 0) std::copy_n(x_next.data(), x_free.size(), x_free.data());
}

double Simulation::Impl::late_books(double t, double h) const {
  if (x_free.size() == 0) return 0;
  const ParticleView from = particles->view(t, x.data()),
                     free = particles->view(t + h, x_free.data()),
                     now = particles->view(t + h, x_next.data());
  double sum = 0;
  for (int i = 0; i < now.n; ++i)
    if (now.free(i))
      sum += now.mass[i] * late_work(h, from.position(i), from.velocity(i), free.position(i),
                                     free.velocity(i), now.velocity(i));
  return sum;
}

bool Simulation::Impl::correct(double t, double h) {
  const StepCorrection::Outcome outcome = correct_once(t, h, true);
  if (outcome != StepCorrection::Outcome::kTooLong)
    return outcome != StepCorrection::Outcome::kFailed;
  const ContactWork work_before = contact_work;
  std::copy_n(x.data(), x.size(), x_begin.data());
  const auto go_back = [&] {
    std::copy_n(x_begin.data(), x.size(), x.data());
    contact_work = work_before;
  };
  try {
    if (step_in_halves(t, h, 1)) {
      integrator->restart(t + h, settings->h, x_next.data());
      return true;
    }
  } catch (...) {
    go_back();
    restart();
    rethrow_in_step(h);
  }
  go_back();
  return false;
}

bool Simulation::Impl::step_in_halves(double t, double h, int halvings) {
  constexpr int kMostHalvings = 10;
  const double half = 0.5 * h;
  for (const int part : {0, 1}) {
    const double begin = t + part * half;
    if (part == 1) std::swap(x, x_next);
    begin_contact(begin);
    integrator->restart(begin, half, x.data());
    const StepStatus status = integrator->step(*system, begin, half, x.data(), x_next.data());
    if (status != StepStatus::kDone && find_divergence(status)) return false;
    const auto outcome = correct_once(begin, half, halvings < kMostHalvings);
    if (outcome == StepCorrection::Outcome::kFailed) return false;
    if (outcome == StepCorrection::Outcome::kTooLong && !step_in_halves(begin, half, halvings + 1))
      return false;
    end_contact(begin + half);
  }
  return true;
}

StepCorrection::Outcome Simulation::Impl::correct_once(double t, double h, bool may_be_halved) {
  using Outcome = StepCorrection::Outcome;
  const auto fail = [&](StepStatus status, const std::string& why) {
    divergence = {status, -1, step_count + 1, t + h, h, "", "", why};
    return Outcome::kFailed;
  };
  const auto refuse = [&](const std::string& why) { return fail(StepStatus::kNotAllowed, why); };
  // The memories of earlier corrections are restored if a later one gives the step up.
  const bool may_undo = stop && corrections.size() > 1;
  const ContactWork work_before = contact_work;
  std::vector<std::vector<double>> memories;
  const auto give_up = [&] {
    for (std::size_t i = 0; i < memories.size(); ++i)
      if (corrections[i]->has_memory()) corrections[i]->recall(memories[i]);
    contact_work = work_before;
    return fail(StepStatus::kStopped, "");
  };
  bool remembered = false;  // a correction stored the step, so that it is not halved any more
  for (const auto& correction : corrections) {
    if (system->cancellation().gives_up()) return give_up();
    if (may_undo) memories.push_back(correction->memory());
    begin_books();
    Outcome outcome = Outcome::kFailed;
    try {
      outcome = correction->apply({t, h, x.data(), x_next.data(), may_be_halved && !remembered});
    } catch (...) {
      restart();
      rethrow_in_step(h);
    }
    if (system->gave_up()) return give_up();
    if (outcome == Outcome::kFailed) return refuse(correction->failure());
    if (outcome == Outcome::kTooLong) {
      contact_work = work_before;
      return outcome;
    }
    if (outcome == Outcome::kChanged) {
      if (!all_finite({x_next.data(), x_next.size()}))
        return refuse(correction->title() + " leads to numbers that are not finite");
      integrator->restart(t + h, h, x_next.data());
    }
    contact_work.lost += correction->take_dissipation(late_books(t, h));
    remembered = remembered || correction->has_memory();
  }
  return Outcome::kChanged;
}

ImpactEvents* Simulation::Impl::impact_events() {
  const bool has_some = particles && !particles->contacts().empty() && integrator->info().adaptive;
  return has_some ? dynamic_cast<ImpactEvents*>(system->events()) : nullptr;
}

void Simulation::Impl::begin_contact(double t) {
  if (!particles || particles->contacts().empty()) return;
  particles->contacts().work_sums().take();  // of steps that others tried
  if (ImpactEvents* const events = impact_events()) events->reported_work().show(t);
}

void Simulation::Impl::end_contact(double t) {
  if (!particles || particles->contacts().empty()) return;
  ImpactEvents* const events = impact_events();
  const ContactWork work =
      events ? events->reported_work().take(t) : particles->contacts().work_sums().take();
  contact_work.lost += work.lost;
  contact_work.given += work.given;
}

void Simulation::Impl::restart() {
  if (ImpactEvents* const events = impact_events()) events->reported_work().forget_ahead();
  if (sleep) sleep->forget_scene();
  integrator->restart(t(step_count), settings->h, x.data());
}

std::span<const std::unique_ptr<StepCorrection>> Simulation::corrections() const {
  return impl_->corrections;
}

ContactWork Simulation::contact_work() const { return impl_->contact_work; }

std::vector<RenderShape> Simulation::shapes() const {
  if (!impl_->particles) return {};
  std::vector<RenderShape> all = impl_->particles->contacts().shapes(t());
  for (int i = 0; i < bodies(); ++i) all.push_back(body(i).drawn(body_state(i)));
  return all;
}

int Simulation::bodies() const { return static_cast<int>(impl_->bodies.size()); }

const RigidBody& Simulation::body(int i) const {
  return impl_->bodies[static_cast<std::size_t>(i)];
}

RigidState Simulation::body_state(int i) const {
  return body(i).state(impl_->particles->view(t(), impl_->x.data()));
}

std::vector<Link> Simulation::links(int particle) const {
  std::vector<Link> list;
  if (!impl_->particles) return list;
  for (const auto& force : impl_->particles->forces()) {
    const auto begin = static_cast<std::ptrdiff_t>(list.size());
    force->links(particle, list);
    std::stable_sort(list.begin() + begin, list.end(),
                     [](const Link& l, const Link& r) { return l.to < r.to; });
  }
  return list;
}

std::vector<std::pair<std::string, long>> Simulation::families() const {
  std::vector<std::pair<std::string, long>> list;
  if (!impl_->particles) return list;
  for (const auto& force : impl_->particles->forces())
    for (const auto& [name, count] : force->families()) {
      const auto same = std::ranges::find(list, name, &std::pair<std::string, long>::first);
      if (same == list.end())
        list.emplace_back(name, count);
      else
        same->second += count;
    }
  return list;
}

}  // namespace sim
