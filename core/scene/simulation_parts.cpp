// What of a simulation acts between and behind its steps: constraints, bodies, contact.
#include <algorithm>
#include <set>

#include "core/base/finite.h"
#include "core/base/text.h"
#include "core/particles/late_velocities.h"
#include "core/particles/rigid/rigid_correction.h"
#include "core/particles/rigid/rigid_rows.h"
#include "core/particles/surface_contact/surface_correction.h"
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

void Simulation::Impl::compile_corrections() {
  for (Force* const force : particles->forces())
    if (auto correction = force->correction(*particles))
      corrections.push_back(std::move(correction));
}

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
    for (const auto& correction : corrections)
      for (const int id : joined.elements.ids)
        if (id < initial.count() && correction->breaks_constraints(id))
          throw Error(ErrorKind::kScene,
                      {"constraint", part.place,
                       "particle " + std::to_string(id) + " is of " + correction->title() +
                           ", which would break it",
                       "leave it out of one of them, or " + correction->remedy()});
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
    corrections.push_back(std::make_unique<SurfaceCorrection>(
        SurfaceContactSpec{contact.surfaces, contact.thickness, contact.friction, contact.self,
                           contact.strain_limit},
        *particles, particles->holding(), particles->view(0, x.data())));
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
    auto bodies_apart = std::make_unique<RigidCorrection>(
        Solids(std::move(solids), *particles, x.data()), std::move(surfaces), *particles,
        spec.constraints.empty() ? nullptr : particles->holding());
    // Surfaces come last: they keep out of the bodies where these end.
    if (spec.contact)
      dynamic_cast<SurfaceCorrection&>(*corrections.back())
          .touch(bodies_apart->solids(), bodies_apart->surfaces());
    corrections.insert(corrections.end() - (spec.contact ? 1 : 0), std::move(bodies_apart));
  });
}

void Simulation::Impl::break_ties(double end, double h) {
  if (!breaking.any()) return;
  const ParticleView view = particles->view(end, x_next.data());
  const std::vector<int> more = breaking.overloaded(view, settings->off);
  if (more.empty()) return;
  set_broken(more, breaking.energy(view, more));
  integrator->restart(end, h, x_next.data());
}

void Simulation::Impl::set_broken(const std::vector<int>& more, double energy) {
  auto wanted = std::make_shared<Settings>(*settings);
  wanted->broken_energy += energy;
  const auto middle = static_cast<std::ptrdiff_t>(wanted->broken.size());
  wanted->broken.insert(wanted->broken.end(), more.begin(), more.end());
  std::inplace_merge(wanted->broken.begin(), wanted->broken.begin() + middle, wanted->broken.end());
  settings = std::move(wanted);
  set_torn(settings->broken);
}

void Simulation::Impl::set_torn(const std::vector<int>& broken) {
  breaking.set_broken(broken);
  for (const auto& correction : corrections) correction->tear(breaking.torn());
}

int Simulation::breakable_ties() const { return impl_->breaking.count(); }
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
  const auto refuse = [&](const std::string& why) {
    divergence = {StepStatus::kNotAllowed, -1, step_count + 1, t + h, h, "", "", why};
    return false;
  };
  for (const auto& correction : corrections) {
    begin_books();
    StepCorrection::Outcome outcome = StepCorrection::Outcome::kFailed;
    try {
      outcome = correction->apply({t, h, x.data(), x_next.data()});
    } catch (...) {
      restart();
      rethrow_in_step();
    }
    if (outcome == StepCorrection::Outcome::kFailed) return refuse(correction->failure());
    if (outcome == StepCorrection::Outcome::kChanged) {
      if (!all_finite({x_next.data(), x_next.size()}))
        return refuse(correction->title() + " leads to numbers that are not finite");
      integrator->restart(t + h, h, x_next.data());
    }
    contact_work.lost += correction->take_dissipation(late_books(t, h));
  }
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

std::span<const std::unique_ptr<StepCorrection>> Simulation::corrections() const {
  return impl_->corrections;
}

ContactWork Simulation::contact_work() const { return impl_->contact_work; }

std::vector<SolidShape> Simulation::shapes() const {
  if (!impl_->particles) return {};
  std::vector<SolidShape> all = impl_->particles->contacts().shapes(t());
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
    for (const auto& family : force->families()) list.push_back(family);
  return list;
}

}  // namespace sim
