// Changes of a simulation between its steps, and their undoing.
#include <algorithm>
#include <cmath>
#include <map>

#include "core/base/text.h"
#include "core/particles/springs/springs.h"
#include "core/scene/simulation_impl.h"
#include "core/scene/sleep.h"

namespace sim {
namespace {

[[noreturn]] void refuse_change(const std::string& what, const std::string& why,
                                const std::string& remedy) {
  throw Error(ErrorKind::kUsage, {what, "", why, remedy});
}

void check_particle(const Simulation& simulation, int i) {
  const int n = simulation.particles();
  if (i >= 0 && i < n) return;
  if (n == 0)
    refuse_change("no such particle", "a flat state has components, not particles",
                  "set a component");
  refuse_change("no such particle", std::to_string(i) + " is none of the " + std::to_string(n),
                "ids run from 0 to " + std::to_string(n - 1));
}

void check_finite(const Vec3& v, const std::string& what) {
  if (!v.allFinite())
    refuse_change("bad " + what, "a number of it is not finite", "give three finite numbers");
}

}  // namespace

std::vector<int> Settings::fixed() const {
  std::vector<int> all;
  std::ranges::set_union(pinned, held, std::back_inserter(all));
  return all;
}

void Simulation::Impl::adopt(std::shared_ptr<const Settings> wanted) {
  const bool other_pins = wanted->pinned != settings->pinned || wanted->held != settings->held;
  const bool other_switches = wanted->off != settings->off;
  const bool other_ties = wanted->broken != settings->broken;
  const auto apply = [&](const Settings& chosen) {
    if (other_ties) set_torn(chosen.broken);
    if (other_pins) particles->set_masses(masses(), chosen.fixed(), !chosen.held.empty());
    if (other_switches) apply_switches(chosen);
  };
  apply(*wanted);
  try {
    make_integrator(*wanted, {});
  } catch (...) {
    apply(*settings);
    throw;
  }
  settings = std::move(wanted);
}

Snapshot Simulation::snapshot() const {
  Snapshot snapshot = snapshot_without_state();
  snapshot.x.assign(state().begin(), state().end());
  return snapshot;
}

Snapshot Simulation::snapshot_without_state() const {
  const Impl& s = *impl_;
  // The memory of the method is followed by that of each correction, with its size; or by all that
  // of the awake system, if islands sleep. Then that of sleeping, likewise.
  std::vector<double> memory;
  const auto add = [&](const std::vector<double>& own) {
    memory.insert(memory.end(), own.begin(), own.end());
    memory.push_back(static_cast<double>(own.size()));
  };
  if (s.sleep && s.sleep->any()) {
    if (const Simulation* const awake = s.sleep->present_scene())
      memory = awake->snapshot_without_state().memory;
  } else {
    memory = s.integrator->memory();
    for (const auto& correction : s.corrections)
      if (correction->has_memory()) add(correction->memory());
  }
  if (s.sleep) add(s.sleep->memory());
  return {s.settings, s.step_count, s.n0, s.t0, {}, std::move(memory)};
}

void Simulation::restore(const Snapshot& snapshot) {
  Impl& s = *impl_;
  if (snapshot.x.size() != s.x.size())
    throw Error(ErrorKind::kInternal, {"a snapshot of another system", name(), "", ""});
  if (snapshot.settings != s.settings) s.adopt(snapshot.settings);
  s.step_count = snapshot.step;
  s.n0 = snapshot.n0;
  s.t0 = snapshot.t0;
  std::ranges::copy(snapshot.x, s.x.data());
  s.restart();
  std::span<const double> memory = snapshot.memory;
  const auto take = [&] {
    const double said = memory.empty() ? 0 : memory.back();
    if (!memory.empty()) memory = memory.first(memory.size() - 1);
    const bool fits = said > 0 && said <= static_cast<double>(memory.size());
    const auto own = memory.last(fits ? static_cast<std::size_t>(said) : std::size_t{0});
    memory = memory.first(memory.size() - own.size());
    return own;
  };
  if (s.sleep && !s.sleep->recall(take(), s.x.data())) s.sleep->reset();
  if (s.sleep && s.sleep->any()) {
    if (memory.empty()) return;
    Simulation* const awake = s.sleep->awake_scene(snapshot_without_state(), s.x.data());
    if (!awake) return;
    Snapshot own = awake->snapshot();
    own.memory.assign(memory.begin(), memory.end());
    awake->restore(own);
    return;
  }
  for (auto correction = s.corrections.rbegin(); correction != s.corrections.rend(); ++correction)
    if ((*correction)->has_memory()) (*correction)->recall(take());
  if (!memory.empty()) s.integrator->recall(memory);
}

// A user's change that breaks constraints moves the others, too, or is refused.
void Simulation::Impl::change(const std::function<void()>& make) {
  const std::vector<double> before(x.data(), x.data() + x.size());
  make();
  const bool settled = system->project(t(step_count), x.data());
  std::string why = settled ? std::string() : system->refusal();
  for (const auto& correction : corrections)
    if (settled && why.empty()) why = correction->objection(t(step_count), x.data());
  if (!settled || !why.empty()) {
    std::ranges::copy(before, x.data());
    restart();
    refuse_change("no such state", why, "");
  }
  restart();
}

void Simulation::Impl::wake(int particle) {
  if (sleep) sleep->wake(particle);
}

void Simulation::Impl::check_not_led(int i) const {
  if (particles && std::ranges::count(particles->prescribed().ids(), i) > 0)
    refuse_change("no change of particle " + std::to_string(i), "it follows a prescribed path", "");
}

void Simulation::set_position(int i, const Vec3& x) {
  check_particle(*this, i);
  check_finite(x, "position");
  Impl& s = *impl_;
  s.check_not_led(i);
  s.wake(i);
  // A position of -0 of a particle becomes 0: adding 0 to it would change its bits.
  s.change([&] {
    for (int axis = 0; axis < 3; ++axis)
      s.number("position", i, axis) = s.particles ? x[axis] + 0.0 : x[axis];
  });
}

void Simulation::set_velocity(int i, const Vec3& v) {
  check_particle(*this, i);
  check_finite(v, "velocity");
  Impl& s = *impl_;
  s.check_not_led(i);
  if (!s.particles)
    refuse_change("no velocity to set", "a first-order scene has none", "set a position");
  if (pinned(i) && !std::ranges::binary_search(s.settings->held, i))
    refuse_change("no velocity to set", "particle " + std::to_string(i) + " is pinned",
                  "unpin it first");
  s.wake(i);
  s.change([&] {
    for (int axis = 0; axis < 3; ++axis) s.number("velocity", i, axis) = v[axis] + 0.0;
  });
}

void Simulation::set_component(int i, double value) {
  if (second_order() || i < 0 || i >= components())
    refuse_change("no such component", std::to_string(i) + " is none of this state", "");
  if (!std::isfinite(value))
    refuse_change("bad component", "it is not finite", "give a finite number");
  impl_->x[static_cast<std::size_t>(i)] = value;
  impl_->restart();
}

bool Simulation::pinned(int i) const {
  return std::ranges::binary_search(impl_->settings->pinned, i);
}

void Simulation::set_pinned(int i, bool hold) {
  check_particle(*this, i);
  Impl& s = *impl_;
  if (!s.particles)
    refuse_change("nothing to pin", "a first-order scene has no masses",
                  "pin particles of a second-order one");
  s.check_not_led(i);
  if (pinned(i) == hold) return;
  s.wake(i);
  auto wanted = std::make_shared<Settings>(*s.settings);
  if (hold)
    wanted->pinned.insert(std::ranges::lower_bound(wanted->pinned, i), i);
  else
    std::erase(wanted->pinned, i);
  const bool in_hand = std::ranges::binary_search(wanted->held, i);
  s.adopt(std::move(wanted));
  s.change([&] {
    for (int axis = 0; axis < 3 && !in_hand; ++axis) s.number("velocity", i, axis) = 0;
  });
}

void Simulation::set_held(int i, bool hold) {
  check_particle(*this, i);
  Impl& s = *impl_;
  if (!s.particles) refuse_change("nothing to hold", "a first-order scene has no masses", "");
  s.check_not_led(i);
  if (std::ranges::binary_search(s.settings->held, i) == hold) return;
  s.wake(i);
  auto wanted = std::make_shared<Settings>(*s.settings);
  if (hold)
    wanted->held.insert(std::ranges::lower_bound(wanted->held, i), i);
  else
    std::erase(wanted->held, i);
  s.adopt(std::move(wanted));
  s.change([&] {
    for (int axis = 0; axis < 3 && (hold || pinned(i)); ++axis) s.number("velocity", i, axis) = 0;
  });
}

void Simulation::set_switch(const std::string& name, bool on) {
  Impl& s = *impl_;
  std::vector<std::string> names;
  for (const auto& each : switches()) names.push_back(each.first);
  if (std::ranges::count(names, name) == 0)
    refuse_change("no such switch", "'" + name + "' is none of this scene",
                  names.empty() ? "name one in the scene: switches = { " + name + " = PART }"
                                : suggestion(name, names));
  auto wanted = std::make_shared<Settings>(*s.settings);
  std::erase(wanted->off, name);
  if (!on) wanted->off.insert(std::ranges::lower_bound(wanted->off, name), name);
  if (wanted->off == s.settings->off) return;
  if (s.sleep) s.sleep->wake_all();
  s.adopt(std::move(wanted));
  s.restart();
}

void Simulation::cut(int a, int b) {
  check_particle(*this, a);
  check_particle(*this, b);
  Impl& s = *impl_;
  const std::vector<int> ties = s.breaking.whole_between(a, b);
  if (ties.empty())
    refuse_change("nothing to cut",
                  "no tie between particles " + std::to_string(a) + " and " + std::to_string(b) +
                      " may break",
                  "give springs break_strain or break_force, rods break_force");
  std::vector<int> broken = s.settings->broken;
  broken.insert(broken.end(), ties.begin(), ties.end());
  s.set_broken(s.breaking.with_bridges(std::move(broken)), 0);  // the user takes the energy in them
  s.restart();
}

std::vector<std::pair<std::string, bool>> Simulation::switches() const {
  std::map<std::string, bool> sorted;
  for (const auto* names : {&impl_->force_switches, &impl_->collider_switches})
    for (const std::string& name : *names)
      if (!name.empty()) sorted[name] = !std::ranges::binary_search(settings().off, name);
  return {sorted.begin(), sorted.end()};
}

void Simulation::set_dt(double new_h) {
  if (!(new_h > 0) || !std::isfinite(new_h))
    refuse_change("bad step size", "dt is " + shortest(new_h), "give a number of seconds > 0");
  Impl& s = *impl_;
  auto wanted = std::make_shared<Settings>(*s.settings);
  wanted->h = new_h;
  s.t0 = t();
  s.n0 = s.step_count;
  s.settings = std::move(wanted);
  s.integrator->set_step_size(new_h);
  s.restart();
}

void Simulation::set_integrator(const Method& method) {
  auto wanted = std::make_shared<Settings>(*impl_->settings);
  wanted->method = method;
  impl_->adopt(std::move(wanted));
  impl_->restart();
}

ConstraintSystem* Simulation::constraint_system() const {
  return impl_->particles ? impl_->particles->constraint_system() : nullptr;
}

const Settings& Simulation::settings() const { return *impl_->settings; }

std::vector<ForceShare> Simulation::forces_on(int i) const {
  check_particle(*this, i);
  return std::move(forces_on(i, i + 1).front());
}

// Springs are distinguished by their families, everything else by its plugin.
std::vector<std::vector<ForceShare>> Simulation::forces_on(int begin, int end) const {
  const Impl& s = *impl_;
  std::vector<std::vector<ForceShare>> all(static_cast<std::size_t>(end - begin));
  if (!s.particles) return all;
  const ParticleView view = s.particles->view(t(), s.x.data());
  const auto n = static_cast<std::size_t>(view.n);
  std::vector<Link> links;
  for (const auto& each : s.particles->forces()) {
    Force& force = *each;
    const auto affine = force.affine();
    const bool accumulates = std::ranges::count(s.particles->other_forces(), &force) > 0;
    Array sums(accumulates ? 3 * n : 0);
    if (accumulates) {
      const ParticleView own = s.particles->seen_by(force, view);
      force.prepare(own, *s.pool);
      force.accumulate(own, {begin, end}, {sums.data(), sums.data() + n, sums.data() + 2 * n});
    }
    for (int i = begin; i < end; ++i) {
      std::vector<ForceShare>& shares = all[static_cast<std::size_t>(i - begin)];
      const auto first = static_cast<std::ptrdiff_t>(shares.size());
      const auto add = [&](const std::string& name, const Vec3& value) {
        const auto share =
            std::find_if(shares.begin() + first, shares.end(),
                         [&](const ForceShare& other) { return other.name == name; });
        if (share == shares.end())
          shares.push_back({name, value});
        else
          share->force += value;
      };
      if (force.springs()) {
        links.clear();
        force.links(i, links);
        for (const Link& link : links)
          add(link.family, spring_force(link.sense, view.position(i) - view.position(link.to),
                                        link.stiffness, link.rest));
        if (!accumulates) continue;
      }
      const auto at = static_cast<std::size_t>(i);
      Vec3 sum = Vec3::Zero();
      if (affine)
        sum += s.initial.at(i).mass * affine->acceleration - affine->damping * view.velocity(i);
      if (accumulates) sum += Vec3(sums[at], sums[n + at], sums[2 * n + at]);
      shares.push_back({s.particles->name_of(force), sum});
    }
  }
  if (!constraint_system()) return all;
  for (const ConstraintForce& each : constraint_system()->forces(t(), s.x.data()))
    for (const int i : {each.a, each.b}) {
      if (i < begin || i >= end) continue;
      std::vector<ForceShare>& shares = all[static_cast<std::size_t>(i - begin)];
      const Vec3 force = i == each.a ? each.force : -each.force;
      if (!shares.empty() && shares.back().name == each.constraint)
        shares.back().force += force;
      else
        shares.push_back({each.constraint, force});
    }
  return all;
}

}  // namespace sim
