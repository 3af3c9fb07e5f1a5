// What of a simulation acts between and behind its steps: constraints, bodies, contact.
#include <algorithm>
#include <set>

#include "core/base/finite.h"
#include "core/base/text.h"
#include "core/particles/projection.h"
#include "core/particles/rigid/rigid_rows.h"
#include "core/particles/touch_events.h"
#include "core/scene/joined.h"
#include "core/scene/simulation_impl.h"

namespace sim {

namespace {

// What is not looked for where bodies touch the particles of surfaces.
std::string note_on_gaps(const SystemSpec& spec, const ParticleView& start) {
  const bool some = std::ranges::any_of(spec.bodies, &RigidSpec::touches);
  if (!spec.contact || !some) return {};
  double longest = 0;
  for (const auto& surface : spec.contact->surfaces)
    for (const auto& t : surface->triangles())
      for (std::size_t k = 0; k < 3; ++k)
        longest = std::max(longest, (start.position(t[k]) - start.position(t[(k + 1) % 3])).norm());
  return "bodies touch the particles of surfaces, not what is between them: corners and edges of "
         "bodies may come through where particles are " +
         brief(longest, 2) + " m apart";
}

}  // namespace

namespace {

void check_not_projected(const Particles& particles, std::span<const int> ids, const Place& place) {
  for (Force* const force : particles.forces())
    for (const int id : ids)
      if (force->projection() && id < particles.layout().n() && force->projection()->leads(id))
        throw Error(ErrorKind::kScene,
                    {"constraint", place,
                     "particle " + std::to_string(id) +
                         " is of a fluid that keeps its density, which would break it",
                     "leave it out of one of them, or give the fluid solver = \"wcsph\""});
}

}  // namespace

void Simulation::Impl::compile_constraints(const SystemSpec& spec, Registry& registry) {
  if (!bodies.empty())
    particles->hold().add(
        std::make_unique<RigidRows>(bodies, note_on_gaps(spec, particles->view(0, x.data()))),
        "rigid", spec.bodies.front().place, 0, x.data());
  for (const PartSpec& part : spec.constraints) {
    const auto& plugin = registry.get<Constraint>(part.plugin, part.place);
    const Params params(plugin.title(), plugin.params, part.given, part.place);
    const Joined joined(part.elements, spec, bodies, initial.count());
    check_elements(joined.elements, plugin, params, joined.count, part.place);
    if (part.elements.empty())
      throw Error(ErrorKind::kScene, {plugin.title(), part.place, "it joins nothing",
                                      plugin.elements.arity == 1 ? "give particles = { ids }"
                                                                 : "give ties = { {a, b}, ... }"});
    check_not_projected(*particles, joined.elements.ids, part.place);
    placed(part.place, [&] {
      auto constraint = made(plugin.make(params, joined.elements), plugin);
      if (!joined.nodes.empty())
        constraint = constraint_on_nodes(std::move(constraint), joined.nodes);
      particles->hold().add(std::move(constraint), plugin.name, part.place,
                            params.has("feedback") ? params.number("feedback") : 0.0, x.data());
    });
  }
  if (!particles->holding()) return;
  particles->holding()->begin();
  if (spec.colliders.empty() || spec.constraints.empty()) return;
  particles->holding()->join_contact(bodies.empty() ? initial.count() : bodies.front().first());
}

void Simulation::Impl::compile_contact(const SystemSpec& spec) {
  if (!spec.contact) return;
  const ContactSpec& contact = *spec.contact;
  if (Holding* const holding = particles->holding();
      holding && holding->constraints().feedback() > 0)
    throw Error(ErrorKind::kScene, {"sim.contact and constraints", contact.place,
                                    "constraints with feedback are not obeyed at each step, and "
                                    "contact would have to put them back",
                                    "leave feedback out"});
  placed(contact.place, [&] {
    surface_contact = std::make_unique<SurfaceContact>(
        SurfaceContactSpec{contact.surfaces, contact.thickness, contact.friction, contact.self,
                           contact.strain_limit},
        *particles, particles->holding(), particles->view(0, x.data()));
  });
}

namespace {

// Bodies, particles and other bodies that a part joins.
void find_tied(const PartSpec& part, const SystemSpec& spec, int n, bool bodies_too,
               SolidsSpec& solids) {
  const std::vector<int>& ids = part.elements.ids;
  const auto arity = static_cast<std::size_t>(std::max(1, part.elements.arity));
  const auto body_of = [&](int id) { return spec.points[static_cast<std::size_t>(id - n)].body; };
  for (std::size_t k = 0; k + arity <= ids.size(); k += arity)
    for (const int point : std::span(ids).subspan(k, arity))
      for (const int other : std::span(ids).subspan(k, arity)) {
        if (point < n) continue;
        if (other < n)
          solids.tied.emplace(body_of(point), other);
        else if (bodies_too && body_of(point) != body_of(other))
          solids.joined.insert(std::minmax(body_of(point), body_of(other)));
      }
}

}  // namespace

// Bodies touch colliders, each other and single particles, but not what is joined to them.
void Simulation::Impl::compile_rigid_contact(const SystemSpec& spec) {
  if (bodies.empty()) return;
  SolidsSpec solids{.bodies = bodies, .singles = bodies.front().first()};
  std::vector<Surface> surfaces;
  for (const RigidSpec& body : spec.bodies) {
    surfaces.push_back(body.surface);
    solids.touch.push_back(body.touches);
  }
  for (const PartSpec& force : spec.forces) find_tied(force, spec, initial.count(), false, solids);
  for (const PartSpec& part : spec.constraints)
    find_tied(part, spec, initial.count(), true, solids);
  const auto touching = std::ranges::count(solids.touch, true);
  const std::int64_t all = touching * solids.singles;
  const bool others = all > static_cast<std::int64_t>(solids.tied.size());
  if (touching == 0 || (touching == 1 && spec.colliders.empty() && !others)) return;
  placed(spec.bodies.front().place, [&] {
    rigid_contact = std::make_unique<RigidContact>(
        Solids(std::move(solids), *particles, x.data()), std::move(surfaces), *particles,
        spec.constraints.empty() ? nullptr : particles->holding());
  });
  if (surface_contact) surface_contact->touch(rigid_contact->solids(), rigid_contact->surfaces());
}

bool Simulation::Impl::keep_bodies_apart(double t, double h) {
  const bool changed = rigid_contact->resolve(t, h, x.data(), x_next.data());
  std::string why = rigid_contact->refusal();
  if (why.empty() && changed && !all_finite({x_next.data(), x_next.size()}))
    why = "contact of rigid bodies leads to numbers that are not finite";
  if (!why.empty()) {
    divergence = {StepStatus::kNotAllowed, -1, step_count + 1, t + h, h, "", "", why};
    return false;
  }
  if (changed) integrator->restart(t + h, h, x_next.data());
  contact_work.lost += rigid_contact->take_work();
  return true;
}

namespace {

std::span<double> memory_of(const Particles& particles, const Force& force, double* state) {
  for (const ForceMemory& memory : particles.memories())
    if (memory.force == &force)
      return {state + particles.layout().size() + memory.begin, memory.size};
  return {};
}

}  // namespace

// What that changes of the energy is booked as what contact takes.
bool Simulation::Impl::project(double t, double h) {
  const double end = t + h;
  const auto energy = [&] {
    return particles->kinetic_energy(end, x_next.data()) +
           particles->potential_energy(end, x_next.data());
  };
  const ParticleView view = particles->view(end, x_next.data());
  const auto q = particles->layout().axes(x_next.data());
  const auto v = particles->layout().axes(x_next.data(), 3);
  const double before = energy();
  const Contacts& contacts = particles->contacts();
  bool changed = false;
  for (Force* const force : particles->forces()) {
    Projection* const own = force->projection();
    if (!own ||
        !own->project({view, h, q.data(), v.data(), memory_of(*particles, *force, x_next.data())},
                      *team))
      continue;
    changed = true;
    for (int i = 0; !contacts.empty() && i < view.n; ++i) {
      if (!own->leads(i) || !view.free(i)) continue;
      Vec3 place = view.position(i);
      contacts.push_out(end, place);
      for (std::size_t axis = 0; axis < 3; ++axis) q[axis][i] = place[axis];
    }
  }
  if (!changed) return true;
  if (!all_finite({x_next.data(), x_next.size()})) {
    divergence = {StepStatus::kNotAllowed,
                  -1,
                  step_count + 1,
                  end,
                  h,
                  "",
                  "",
                  "keeping the density of a fluid leads to numbers that are not finite"};
    return false;
  }
  contact_work.lost += before - energy();
  integrator->restart(end, h, x_next.data());
  return true;
}

std::string Simulation::Impl::acts_between() const {
  if (surface_contact) return "sim.contact";
  if (rigid_contact) return "contact of rigid bodies";
  return projects ? "a fluid with solver = \"dfsph\"" : "";
}

void Simulation::Impl::forget() {
  if (rigid_contact) rigid_contact->forget();
  if (!projects) return;
  for (Force* const force : particles->forces())
    if (force->projection()) force->projection()->forget();
}

bool Simulation::Impl::keep_apart(double t, double h) {
  if (projects) {
    try {
      if (!project(t, h)) return false;
    } catch (...) {
      restart();
      rethrow_in_step();
    }
  }
  if (rigid_contact && !keep_bodies_apart(t, h)) return false;
  if (!surface_contact) return true;
  const auto outcome = surface_contact->resolve(*particles, t, h, x.data(), x_next.data());
  if (outcome == SurfaceContact::Outcome::kRefused) {
    divergence = {StepStatus::kNotAllowed,   -1, step_count + 1, t + h, h, "", "",
                  surface_contact->refusal()};
    return false;
  }
  if (outcome == SurfaceContact::Outcome::kChanged) integrator->restart(t + h, h, x_next.data());
  contact_work.lost += surface_contact->take_work();
  return true;
}

TouchEvents* Simulation::Impl::touch_events() {
  const bool has_some = particles && !particles->contacts().empty() && integrator->info().adaptive;
  return has_some ? dynamic_cast<TouchEvents*>(system->events()) : nullptr;
}

void Simulation::Impl::begin_contact(double t) {
  if (!particles || particles->contacts().empty()) return;
  particles->contacts().ledger().take();  // of steps that others tried
  if (TouchEvents* const events = touch_events()) events->shown().show(t);
}

void Simulation::Impl::end_contact(double t) {
  if (!particles || particles->contacts().empty()) return;
  TouchEvents* const events = touch_events();
  const ContactWork work = events ? events->shown().take(t) : particles->contacts().ledger().take();
  contact_work.lost += work.lost;
  contact_work.given += work.given;
}

void Simulation::Impl::restart() {
  if (TouchEvents* const events = touch_events()) events->shown().forget_ahead();
  integrator->restart(t(step_count), settings->h, x.data());
}

const SurfaceContact* Simulation::surface_contact() const { return impl_->surface_contact.get(); }

ContactWork Simulation::contact_work() const { return impl_->contact_work; }

std::vector<SolidShape> Simulation::shapes() const {
  if (!impl_->particles) return {};
  std::vector<SolidShape> all = impl_->particles->contacts().shapes(t());
  for (int i = 0; i < bodies(); ++i) all.push_back(body(i).drawn(body_state(i)));
  return all;
}

const RigidContact* Simulation::rigid_contact() const { return impl_->rigid_contact.get(); }

int Simulation::bodies() const { return static_cast<int>(impl_->bodies.size()); }

const RigidBody& Simulation::body(int i) const {
  return impl_->bodies[static_cast<std::size_t>(i)];
}

RigidState Simulation::body_state(int i) const {
  return body(i).state(impl_->particles->view(t(), impl_->x.data()));
}

}  // namespace sim
