#include "core/scene/sleep.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/base/disjoint_sets.h"
#include "core/base/text.h"
#include "core/geometry/triangle_mesh.h"
#include "core/particles/force.h"
#include "core/scene/scene_part.h"

namespace sim {
namespace {

constexpr int kLooks = 16;     // within SleepSpec::after
constexpr double kAwake = -1;  // in place of the time since when an island rests

[[noreturn]] void refuse_sleep(const SourceLocation& place, const std::string& why,
                               const std::string& remedy) {
  throw Error(ErrorKind::kScene, {"sleep does not fit", place, why, remedy});
}

// Elements name points of bodies, too, as numbers beyond those of particles.
void join_elements(const PartSpec& part, const SystemSpec& spec, DisjointSets& joined) {
  const int n = spec.particles->count();
  const auto particle = [&](int id) {
    if (id < n) return id;
    const BodyPoint& point = spec.points[static_cast<std::size_t>(id - n)];
    return spec.bodies[static_cast<std::size_t>(point.body)].first;
  };
  part.elements.for_each([&](const Element& element) {
    for (const int id : element.ids) joined.join(particle(element.ids.front()), particle(id));
  });
}

// A force without elements acts on each particle by itself, or on surfaces, each of which is then
// one island.
void join_force(const PartSpec& part, const PluginInfo& plugin, const SystemSpec& spec,
                DisjointSets& joined) {
  join_elements(part, spec, joined);
  bool on_surface = false;
  for (const auto& [name, value] : part.given)
    if (const auto* mesh = std::get_if<std::shared_ptr<const TriangleMesh>>(&value)) {
      joined.join((*mesh)->ids());
      on_surface = true;
    }
  const bool alone = plugin.pointwise && plugin.elements.arity == 0;
  if (part.elements.empty() && !on_surface && !alone)
    refuse_sleep(part.place, plugin.title() + " may join any particles, so that none rests alone",
                 "leave sleep out, or give it ties or a surface");
}

void join_constraint(const PartSpec& part, const PluginInfo& plugin, const SystemSpec& spec,
                     DisjointSets& joined) {
  if (part.elements.empty())
    refuse_sleep(part.place, plugin.title() + " has no elements of its own", "leave sleep out");
  join_elements(part, spec, joined);
}

// The range of contact, m: the largest length among its parameters.
double reach_of(const ContactSpec& spec, Registry& registry) {
  const auto& plugin = registry.get<StepCorrection>(spec.plugin, spec.place);
  const Params params(plugin.title(), plugin.params, spec.given, spec.place);
  double reach = 0;
  for (const Param& param : plugin.params)
    if (param.unit == "m" && params.has(param.name))
      reach = std::max(reach, params.number(param.name));
  return reach;
}

}  // namespace

Sleep::Sleep(const SystemSpec& spec, Registry& registry, Threads threads, ParticleSystem& particles)
    : spec_(spec), registry_(&registry), threads_(threads), particles_(&particles) {
  const SleepSpec& wish = *spec.sleep;
  if (!(wish.energy > 0) || !std::isfinite(wish.energy))
    refuse_sleep(spec.place, "its energy is " + shortest(wish.energy), "give a number of J > 0");
  if (!(wish.after > 0) || !std::isfinite(wish.after))
    refuse_sleep(spec.place, "after is " + shortest(wish.after), "give a number of seconds > 0");
  if (particles.size() > particles.layout().size())
    refuse_sleep(spec.place, "this scene has forces or constraints with internal variables",
                 "leave sleep out");
  if (particles.constraint_system() && particles.constraint_system()->constraints().move())
    refuse_sleep(spec.place, "this scene has constraints that move", "leave sleep out");
  for (Force* const force : particles.forces())
    if (force->breakable())
      refuse_sleep(spec.place, "'" + particles.name_of(*force) + "' has ties that may break",
                   "leave sleep out, or break_strain and break_force");
  if (const ConstraintSystem* const system = particles.constraint_system())
    for (std::size_t part = 0; part < system->constraints().rows().parts.size(); ++part)
      if (system->constraints().breakable(part))
        refuse_sleep(spec.place, "this scene has rods that may break",
                     "leave sleep out, or break_force");
  const int n = spec.particles->count();
  DisjointSets joined(static_cast<std::size_t>(n));
  for (const PartSpec& part : spec.forces)
    join_force(part, registry.get<Force>(part.plugin, part.place), spec, joined);
  for (const PartSpec& part : spec.constraints)
    join_constraint(part, registry.get<Constraint>(part.plugin, part.place), spec, joined);
  reach_ = spec.contact ? reach_of(*spec.contact, registry) : spec.bodies.empty() ? -1 : 0;
  first_of_bodies_ = spec.bodies.empty() ? n : spec.bodies.front().first;
  for (const RigidSpec& body : spec.bodies) {
    for (int k = 1; k < RigidBody::kParticles; ++k) joined.join(body.first, body.first + k);
    radii_.push_back(RigidBody(body.shape, body.mass, body.first).radius());
  }

  island_.resize(static_cast<std::size_t>(n));
  std::vector<std::vector<int>> members;
  for (int i = 0; i < n; ++i) {
    const int root = joined.root(i);
    int& island = island_[static_cast<std::size_t>(i)];
    island = root == i ? static_cast<int>(members.size()) : island_[static_cast<std::size_t>(root)];
    if (root == i) members.emplace_back();
    members[static_cast<std::size_t>(island)].push_back(i);
  }
  for (const std::vector<int>& ids : members) members_.emplace_back(ids);
  since_.resize(islands());
  sleeps_.resize(islands());
  free_until_.resize(islands());
  boxes_.resize(islands());
  then_ = Array(Layout(n, 3).size());
  now_ = Array(Layout(n, 3).size());
  reset();
}

Sleep::~Sleep() = default;

SleepAccount Sleep::account() const {
  SleepAccount account{static_cast<int>(islands()), asleep_, 0, taken_};
  for (std::size_t island = 0; island < islands(); ++island)
    if (sleeps_[island]) account.since = std::max(account.since, since_[island]);
  return account;
}

void Sleep::reset() {
  wake_all();
  scene_.reset();
  taken_ = 0;
}

void Sleep::wake_all() {
  for (std::size_t island = 0; island < islands(); ++island) {
    rouse(island);
    since_[island] = kAwake;
  }
}

void Sleep::wake(int particle) {
  rouse(static_cast<std::size_t>(island_[static_cast<std::size_t>(particle)]));
}

void Sleep::rouse(std::size_t island) {
  if (!sleeps_[island]) return;
  scene_.reset();
  sleeps_[island] = 0;
  since_[island] = kAwake;
  --asleep_;
}

template <class Visit>
void Sleep::for_each_ball(std::size_t island, const ParticleView& view, Visit&& visit) const {
  members_[island].for_each([&](int i) {
    if (i < first_of_bodies_) return visit(view.position(i), view.velocity(i), 0.0);
    if ((i - first_of_bodies_) % RigidBody::kParticles != 0) return;
    Vec3 center(0, 0, 0), velocity(0, 0, 0);
    for (int k = 0; k < RigidBody::kParticles; ++k) {
      center += view.position(i + k) / RigidBody::kParticles;
      velocity += view.velocity(i + k) / RigidBody::kParticles;
    }
    const int body = (i - first_of_bodies_) / RigidBody::kParticles;
    visit(center, velocity, radii_[static_cast<std::size_t>(body)]);
  });
}

// The bounding box of its particles now and, with the present velocities, some seconds ahead.
Sleep::Box Sleep::box(std::size_t island, const ParticleView& view, double ahead) const {
  const double most = std::numeric_limits<double>::infinity();
  Box box{Vec3(most, most, most), Vec3(-most, -most, -most)};
  for_each_ball(island, view, [&](const Vec3& center, const Vec3& velocity, double radius) {
    for (const double s : {0.0, ahead}) {
      const Vec3 at = center + s * velocity;
      for (int axis = 0; axis < 3; ++axis) {
        box.low[axis] = std::min(box.low[axis], at[axis] - radius);
        box.high[axis] = std::max(box.high[axis], at[axis] + radius);
      }
    }
  });
  return box;
}

bool Sleep::near(const Box& a, const Box& b) const {
  const double apart = 2 * reach_;
  for (int axis = 0; axis < 3; ++axis)
    if (a.low[axis] > b.high[axis] + apart || b.low[axis] > a.high[axis] + apart) return false;
  return true;
}

// A gap closes no faster than max_speed(): until then no particle has to be tested again.
bool Sleep::touches_moving(std::size_t island, const ParticleView& view, double until) {
  const Contacts& contacts = particles_->contacts();
  const double horizon = until + spec_.sleep->after;
  free_until_[island] = horizon;
  if (!contacts.move()) return false;
  for (Collider* const collider : contacts.all()) {
    if (!collider->moves()) continue;
    double gap = std::numeric_limits<double>::infinity();
    bool touches = false;
    for_each_ball(island, view, [&](const Vec3& at, const Vec3&, double radius) {
      const SurfaceSample sample = collider->query(until, at);
      gap = std::min(gap, sample.gap - radius);
      touches = touches ||
                (sample.gap - radius <= 2 * Contacts::slack(at) && sample.velocity != Vec3::Zero());
    });
    if (touches) return true;
    const double speed = collider->sampled() ? std::numeric_limits<double>::infinity()
                                             : collider->max_speed(until, horizon);
    if (speed > 0)
      free_until_[island] = std::min(free_until_[island], until + std::max(gap, 0.0) / speed);
  }
  return false;
}

void Sleep::accelerations(double t, const double* x) {
  const std::array<double*, 3> a = Layout(particles_->layout().n(), 3).axes(now_.data());
  particles_->accelerate(particles_->view(t, x), a.data());
}

// The energy, J, that the change of forces since then would have given by the time after which it
// may fall asleep: sum m |a - a_then|^2 after^2 / 2.
double Sleep::gain(std::size_t island) const {
  const Layout layout(particles_->layout().n(), 3);
  const std::span<const double> masses = particles_->masses();
  double sum = 0;
  members_[island].for_each([&](int i) {
    const double mass = masses[static_cast<std::size_t>(i)];
    if (!std::isfinite(mass)) return;
    for (int axis = 0; axis < 3; ++axis) {
      const double change =
          layout.block(now_.data(), axis)[i] - layout.block(then_.data(), axis)[i];
      sum += mass * change * change;
    }
  });
  return 0.5 * sum * spec_.sleep->after * spec_.sleep->after;
}

void Sleep::remember(std::size_t island) {
  const Layout layout(particles_->layout().n(), 3);
  members_[island].for_each([&](int i) {
    for (int axis = 0; axis < 3; ++axis)
      layout.block(then_.data(), axis)[i] = layout.block(now_.data(), axis)[i];
  });
}

// The golden ratio spreads the times: k + frac(k phi) / 2, in a 16th of `after`.
double Sleep::moment(std::int64_t look) const {
  constexpr double kPhi = 0.6180339887498949;
  const auto k = static_cast<double>(look);
  return spec_.sleep->after / kLooks * (k + 0.5 * (k * kPhi - std::floor(k * kPhi)));
}

std::int64_t Sleep::looks_until(double t) const {
  constexpr double kMost = 1e15;  // beyond it moments are not told apart, and there are no looks
  const double before = t / spec_.sleep->after * kLooks - 1;
  if (!(before < kMost)) return static_cast<std::int64_t>(kMost);
  auto count = static_cast<std::int64_t>(std::max(0.0, before));
  while (moment(count) <= t) ++count;
  return count;
}

bool Sleep::may_be_disturbed() const {
  return any() &&
         (reach_ >= 0 || particles_->contacts().move() || !particles_->prescribed().empty());
}

void Sleep::wake_disturbed(double t, double h, const double* x) {
  if (!may_be_disturbed()) return;
  const ParticleView view = particles_->view(t, x);
  if (particles_->contacts().sampled()) particles_->contacts().prepare_interval(t, t + h);
  const auto wake_where = [&](const auto& disturbed) {
    for (std::size_t island = 0; island < islands(); ++island)
      if (sleeps_[island] && disturbed(island)) rouse(island);
  };

  if (!particles_->prescribed().empty()) {
    const auto v = Layout(view.n, 3).axes(now_.data());
    particles_->prescribed().velocities(t + h, v);
    for (const int i : particles_->prescribed().ids())
      if (v[0][i] != 0 || v[1][i] != 0 || v[2][i] != 0) wake(i);
  }
  if (particles_->contacts().move())
    wake_where([&](std::size_t island) {
      return free_until_[island] <= t + h && touches_moving(island, view, t + h);
    });
  // Islands that wake take all with them that they lie on.
  if (reach_ < 0) return;
  std::vector<std::size_t> movers;
  for (std::size_t island = 0; island < islands(); ++island)
    if (!sleeps_[island]) movers.push_back(island);
  for (std::size_t k = 0; k < movers.size(); ++k) {
    const Box way = box(movers[k], view, 2 * h);
    for (std::size_t island = 0; island < islands(); ++island) {
      if (!sleeps_[island] || !near(way, boxes_[island])) continue;
      rouse(island);
      movers.push_back(island);
    }
  }
}

// Islands that are near each other rest together or not at all.
std::vector<std::uint8_t> Sleep::ready(double t, const ParticleView& view) {
  std::vector<std::uint8_t> ready(islands());
  std::vector<int> awake;
  bool any = false;
  for (std::size_t island = 0; island < islands(); ++island) {
    if (sleeps_[island]) continue;
    awake.push_back(static_cast<int>(island));
    ready[island] = since_[island] >= 0 && t - since_[island] >= spec_.sleep->after &&
                    !touches_moving(island, view, t);
    any = any || ready[island];
  }
  if (!any || reach_ < 0) return ready;
  std::vector<Box> boxes;
  for (const int island : awake) boxes.push_back(box(static_cast<std::size_t>(island), view, 0));
  std::vector<std::size_t> order(awake.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t k) { return boxes[k].low.x(); });
  DisjointSets joined(awake.size());
  for (std::size_t a = 0; a < order.size(); ++a)
    for (std::size_t b = a + 1; b < order.size(); ++b) {
      if (boxes[order[b]].low.x() > boxes[order[a]].high.x() + 2 * reach_) break;
      if (near(boxes[order[a]], boxes[order[b]]))
        joined.join(static_cast<int>(order[a]), static_cast<int>(order[b]));
    }
  std::vector<std::uint8_t> all(awake.size(), 1);
  const auto root = [&](std::size_t k) {
    return static_cast<std::size_t>(joined.root(static_cast<int>(k)));
  };
  for (std::size_t k = 0; k < awake.size(); ++k)
    all[root(k)] &= ready[static_cast<std::size_t>(awake[k])];
  for (std::size_t k = 0; k < awake.size(); ++k)
    ready[static_cast<std::size_t>(awake[k])] = all[root(k)];
  return ready;
}

void Sleep::wake_changed(double t, const double* x) {
  accelerations(t, x);
  for (std::size_t island = 0; island < islands(); ++island)
    if (sleeps_[island] && !(gain(island) <= spec_.sleep->energy)) rouse(island);
}

// Springs and affine forces do not depend on time; others are evaluated once in every `after`, as
// that takes as long as a step of all.
void Sleep::look(double from, double t, double* x) {
  const std::int64_t before = looks_until(from), now = looks_until(t);
  if (now == before) return;
  if (any() && !particles_->other_forces().empty() && now / kLooks > before / kLooks)
    wake_changed(t, x);
  const ParticleView view = particles_->view(t, x);
  bool some = false;
  for (std::size_t island = 0; island < islands(); ++island) {
    if (sleeps_[island]) continue;
    const bool rests = members_[island].kinetic_energy(view) < spec_.sleep->energy;
    if (!rests) since_[island] = kAwake;
    if (rests && since_[island] < 0) since_[island] = t;
    some = some || (rests && t - since_[island] >= spec_.sleep->after);
  }
  if (!some) return;
  const std::vector<std::uint8_t> falls = ready(t, view);
  if (std::ranges::count(falls, 1) == 0) return;
  for (std::size_t island = 0; island < islands(); ++island) {
    if (!falls[island]) continue;
    taken_ += members_[island].kinetic_energy(view);
    members_[island].for_each([&](int i) {
      for (int axis = 0; axis < 3; ++axis) particles_->layout().block(x, 3 + axis)[i] = 0;
    });
    sleeps_[island] = 1;
    since_[island] = t;
    boxes_[island] = box(island, view, 0);
    ++asleep_;
  }
  accelerations(t, x);
  for (std::size_t island = 0; island < islands(); ++island)
    if (falls[island]) remember(island);
  scene_.reset();
}

Simulation* Sleep::awake_scene(const Snapshot& now, const double* x) {
  if (scene_) return scene_.get();
  std::vector<int> ids;
  for (std::size_t i = 0; i < island_.size(); ++i)
    if (!sleeps_[static_cast<std::size_t>(island_[i])]) ids.push_back(static_cast<int>(i));
  if (ids.empty()) return nullptr;
  awake_ = Subset(ids);
  const SystemSpec part = scene_part(spec_, ids);
  const Settings& all = *now.settings;
  scene_ = std::make_unique<Simulation>(part, *registry_,
                                        RunOptions{all.method.choice(), all.h, threads_});
  auto settings = std::make_shared<Settings>(all);
  const auto number = [&](std::vector<int>& of_all) {
    std::vector<int> left;
    for (const int id : of_all)
      if (const auto at = std::ranges::lower_bound(ids, id); at != ids.end() && *at == id)
        left.push_back(static_cast<int>(at - ids.begin()));
    of_all = std::move(left);
  };
  number(settings->pinned);
  number(settings->held);
  std::vector<double> state(scene_->state().begin(), scene_->state().end());
  awake_.gather(particles_->layout(), x, state.data());
  scene_->restore({settings, now.step, now.n0, now.t0, std::move(state), {}});
  return scene_.get();
}

void Sleep::scatter(double* x) const {
  awake_.scatter(scene_->state().data(), particles_->layout(), x);
}

std::vector<double> Sleep::memory() const {
  std::vector<double> numbers(since_);
  numbers.insert(numbers.end(), sleeps_.begin(), sleeps_.end());
  numbers.push_back(taken_);
  return numbers;
}

// The accelerations of an island depend on its own particles and the time alone.
bool Sleep::recall(std::span<const double> memory, const double* x) {
  if (memory.size() != 2 * islands() + 1) return false;
  std::vector<double> times;
  for (std::size_t island = 0; island < islands(); ++island) {
    const double since = memory[island], sleeps = memory[islands() + island];
    if ((sleeps != 0 && sleeps != 1) || (sleeps == 1 && since < 0)) return false;
  }
  wake_all();
  taken_ = memory.back();
  for (std::size_t island = 0; island < islands(); ++island) {
    since_[island] = memory[island];
    sleeps_[island] = memory[islands() + island] == 1;
    if (!sleeps_[island]) continue;
    ++asleep_;
    free_until_[island] = 0;
    boxes_[island] = box(island, particles_->view(0, x), 0);
    times.push_back(since_[island]);
  }
  std::ranges::sort(times);
  times.erase(std::unique(times.begin(), times.end()), times.end());
  for (const double time : times) {
    accelerations(time, x);
    for (std::size_t island = 0; island < islands(); ++island)
      if (sleeps_[island] && since_[island] == time) remember(island);
  }
  return true;
}

}  // namespace sim
