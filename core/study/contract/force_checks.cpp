// Checks of forces, on clouds of particles that move at random.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <set>
#include <type_traits>

#include "core/base/thread_pool.h"
#include "core/particles/particle_system.h"
#include "core/study/contract/examiner.h"

namespace sim::study::contract {
namespace {

constexpr int kFew = 12, kMany = 8 * 2048;  // particles

// Elements that join neighbours in id, for a force between particles, with the values that have no
// default.
Elements ties(const PluginInfo& plugin, int n) {
  Elements elements;
  elements.arity = std::max(plugin.elements.arity, 2);
  for (int i = 0; plugin.elements.arity > 0 && i + elements.arity <= n; ++i) {
    for (int corner = 0; corner < elements.arity; ++corner) elements.ids.push_back(i + corner);
    for (const Param& param : plugin.params)
      if (param.per_tie && std::holds_alternative<std::monostate>(param.default_value))
        elements.values[param.name].push_back(
            std::clamp(0.5 + 0.125 * (i % 5), param.min, param.max));
  }
  return elements;
}

// A pseudo-random number in (-1, 1) for each i.
double random(int i) {
  StateHash hash;
  hash.add(static_cast<std::uint64_t>(i));
  return static_cast<double>(hash.value() >> 11) * 0x1p-52 - 1;
}

// Particles at random positions under one force.
class Cloud {
 public:
  Cloud(const ForcePlugin& plugin, const Params& params, int n, int threads)
      : layout_(n), pool_(threads), x_(layout_.size()), y_(layout_.size()), rate_(layout_.size()) {
    place(0, 0);
    std::vector<double> masses(static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i) masses[static_cast<std::size_t>(i)] = mass(i);
    std::vector<std::unique_ptr<Force>> forces;
    forces.push_back(made(plugin.make(params, ties(plugin, n)), plugin));
    system_ = std::make_unique<ParticleSystem>(masses, std::vector<int>{}, std::move(forces),
                                               x_.data(), pool_);
    if (system_->internal_size() == 0) return;
    for (Array* state : {&x_, &y_, &rate_}) *state = Array(system_->size());
    system_->start_internal(x_.data());
    place(0, 0);
  }

  const Force& force() const { return *system_->forces().front(); }
  ParticleView view() const { return system_->seen_by(force(), all()); }
  int n() const { return layout_.n(); }
  double& position(int i, int axis) { return layout_.block(x_.data(), axis)[i]; }
  double& velocity(int i, int axis) { return layout_.block(x_.data(), 3 + axis)[i]; }

  // Places the particles in another random state for each number; `fast` changes velocities alone.
  void place(int state, int fast) {
    for (int i = 0; i < layout_.n(); ++i)
      for (int axis = 0; axis < 3; ++axis) {
        position(i, axis) = 0.4 * i * (axis == 0) + random(3 * i + axis + 100003 * state);
        velocity(i, axis) = random(3 * i + axis + 100003 * state + 51 + 977 * fast);
      }
  }

  // m a of every particle: x of all, then y, then z.
  std::vector<double> forces() {
    system_->eval(0.25, {x_.data(), {}}, y_.data(), rate_.data());
    std::vector<double> list;
    for (int axis = 0; axis < 3; ++axis)
      for (int i = 0; i < layout_.n(); ++i)
        list.push_back(mass(i) * layout_.block(rate_.data(), 3 + axis)[i]);
    return list;
  }

  // The rates of the internal variables.
  std::vector<double> memory_rates() {
    system_->eval(0.25, {x_.data(), {}}, y_.data(), rate_.data());
    const auto begin = rate_.data() + layout_.size();
    return {begin, begin + system_->internal_size()};
  }

  // The friction of a force with a dissipative_part(), as forces().
  std::vector<double> resistance() {
    const auto n = static_cast<std::size_t>(layout_.n());
    std::vector<double> sum(3 * n);
    const ParticleView now = view();
    system_->prepare_gather(all());
    force().dissipative_part(now, {0, now.n}, {sum.data(), sum.data() + n, sum.data() + 2 * n});
    return sum;
  }

  // Evaluates a force as a stage does; takes no memory itself.
  void evaluate() { system_->eval(0.25, {x_.data(), {}}, y_.data(), rate_.data()); }

  double potential() const { return system_->potential_energy(0.25, x_.data()); }

  // Accumulates the force over tiles of that many particles, for a force that is gathered.
  std::vector<double> in_tiles(int size) {
    const auto n = static_cast<std::size_t>(layout_.n());
    Array sum(3 * n);
    const ParticleView now = view();
    system_->prepare_gather(all());
    for (int begin = 0; begin < now.n; begin += size)
      force().accumulate(now, {begin, std::min(begin + size, now.n)},
                         {sum.data(), sum.data() + n, sum.data() + 2 * n});
    return {sum.data(), sum.data() + 3 * n};
  }

  // Accumulates a sweep that begins at a particle, in tiles; 0 before it. For forces that have one.
  std::vector<double> swept(int first, int size) {
    const auto n = static_cast<std::size_t>(layout_.n());
    std::vector<double> sum(3 * n);
    const ParticleView now = view();
    const std::unique_ptr<ForceSweep> sweep = force().sweep();
    sweep->start(now, first);
    for (int begin = first; begin < now.n; begin += size)
      sweep->add(now, {begin, std::min(begin + size, now.n)},
                 {sum.data(), sum.data() + n, sum.data() + 2 * n});
    return sum;
  }

 private:
  ParticleView all() const { return system_->view(0.25, x_.data()); }
  static double mass(int i) { return 1 + 0.125 * (i % 4); }

  Layout layout_;
  ThreadPool pool_;
  Array x_, y_, rate_;
  std::unique_ptr<ParticleSystem> system_;
};

// Central differences of f by one number of the state, with a step that balances truncation and
// rounding.
template <class F>
auto difference(double& number, F f) {
  constexpr double kStep = 1e-5;
  const double before = number;
  number = before + kStep;
  auto above = f();
  number = before - kStep;
  const auto below = f();
  number = before;
  if constexpr (std::is_same_v<decltype(above), double>) {
    return (above - below) / (2 * kStep);
  } else {
    for (std::size_t i = 0; i < above.size(); ++i) above[i] = (above[i] - below[i]) / (2 * kStep);
    return above;
  }
}

double largest(const std::vector<double>& list) {
  double most = 0;
  for (const double number : list) most = std::max(most, std::fabs(number));
  return most;
}

constexpr double kAgree = 1e-5;  // of the largest: differences are good to about 1e-9

std::string share(double worst, const std::string& of) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1e", worst);
  return "differs by " + std::string(text) + " of the largest " + of;
}

void check_potential(Cloud& cloud, Examiner& examiner) {
  constexpr const char* kName = "F = -dU/dx";
  double error = 0, most_force = 1e-300, most_potential = 0;
  for (int state = 0; state < 3; ++state) {
    cloud.place(state, 0);
    std::vector<double> forces = cloud.forces();
    if (cloud.force().has_dissipative_part()) {
      const std::vector<double> friction = cloud.resistance();
      for (std::size_t k = 0; k < forces.size(); ++k) forces[k] -= friction[k];
    }
    most_force = std::max(most_force, largest(forces));
    for (int i = 0; i < cloud.n(); ++i)
      for (int axis = 0; axis < 3; ++axis) {
        const double slope = difference(cloud.position(i, axis), [&] { return cloud.potential(); });
        error = std::max(error,
                         std::fabs(slope + forces[static_cast<std::size_t>(axis * cloud.n() + i)]));
      }
    most_potential = std::max(most_potential, std::fabs(cloud.potential()));
  }
  const double worst = error / most_force;
  if (cloud.force().conservative() || cloud.force().has_dissipative_part())
    examiner.check(kName, worst < kAgree, share(worst, "force"));
  else
    examiner.skipped(kName, most_potential == 0 ? "it has no potential"
                            : worst < kAgree    ? "it holds, but conservative() does not say so"
                                                : "conservative() does not say so");
}

// The Jacobian blocks of a force as a full matrix, rows and columns as in Cloud::forces().
struct Blocks final : JacobianSink {
  explicit Blocks(int count)
      : n(count),
        position_part(static_cast<std::size_t>(9 * n * n)),
        velocity_part(position_part) {}
  void position(int i, int j, const Mat3& block) override { add(position_part, i, j, block); }
  void velocity(int i, int j, const Mat3& block) override { add(velocity_part, i, j, block); }
  void add(std::vector<double>& matrix, int i, int j, const Mat3& block) {
    for (int row = 0; row < 3; ++row)
      for (int col = 0; col < 3; ++col)
        matrix[static_cast<std::size_t>((row * n + i) * 3 * n + col * n + j)] += block(row, col);
  }

  int n;
  std::vector<double> position_part, velocity_part;
};

void check_jacobian(Cloud& cloud, Examiner& examiner, const std::string& with = {}) {
  const std::string name = "Jacobian against differences" + with;
  if (!cloud.force().has_jacobian()) return examiner.skipped(name, "it has none of its own");
  cloud.place(1, 0);
  cloud.in_tiles(cloud.n());
  Blocks blocks(cloud.n());
  cloud.force().jacobian(cloud.view(), blocks);
  const auto side = static_cast<std::size_t>(3 * cloud.n());
  double error = 0, size = 0;
  for (const bool by_velocity : {false, true})
    for (int j = 0; j < cloud.n(); ++j)
      for (int axis = 0; axis < 3; ++axis) {
        double& number = by_velocity ? cloud.velocity(j, axis) : cloud.position(j, axis);
        const std::vector<double> column =
            difference(number, [&] { return cloud.in_tiles(cloud.n()); });
        const auto at = static_cast<std::size_t>(axis * cloud.n() + j);
        const auto& matrix = by_velocity ? blocks.velocity_part : blocks.position_part;
        for (std::size_t row = 0; row < side; ++row)
          error = std::max(error, std::fabs(matrix[row * side + at] - column[row]));
        size = std::max(size, largest(column));
      }
  const double worst = error / std::max(size, 1e-300);
  examiner.check(name, worst < kAgree, share(worst, "derivative"));
}

// Checks that every block added in a few states belongs to a pair that couplings() names.
void check_couplings(Cloud& cloud, Examiner& examiner) {
  std::vector<std::array<int, 2>> pairs;
  if (!cloud.force().has_jacobian() || !cloud.force().couplings(pairs)) return;
  struct Unnamed final : JacobianSink {
    std::set<std::array<int, 2>> named;
    std::optional<std::array<int, 2>> found;
    void position(int i, int j, const Mat3&) override {
      if (i != j && !named.contains({std::min(i, j), std::max(i, j)})) found = {i, j};
    }
    void velocity(int i, int j, const Mat3& block) override { position(i, j, block); }
  } sink;
  for (const auto& [a, b] : pairs) sink.named.insert({std::min(a, b), std::max(a, b)});
  for (const int state : {0, 1, 2}) {
    cloud.place(state, 1);
    cloud.in_tiles(cloud.n());
    cloud.force().jacobian(cloud.view(), sink);
  }
  examiner.check("couplings() names every pair", !sink.found,
                 sink.found ? "it does not name " + std::to_string((*sink.found)[0]) + " and " +
                                  std::to_string((*sink.found)[1])
                            : std::to_string(sink.named.size()) + " pairs");
}

void check_velocity(Cloud& cloud, Examiner& examiner) {
  constexpr const char* kName = "depends_on_velocity is honest";
  if (cloud.force().affine() || cloud.force().springs())
    return examiner.skipped(kName, "it is affine or made of springs");
  cloud.place(0, 0);
  const std::vector<double> slow = cloud.forces();
  cloud.place(0, 1);
  const bool equal = same(slow, cloud.forces());
  if (cloud.force().depends_on_velocity())
    examiner.ok(kName, equal ? "it says it does; on these states it does not: verlet could run it"
                             : "it does");
  else
    examiner.check(kName, equal, equal ? "it does not" : "it says it does not, but it does");
}

void check_memory(Cloud& cloud, Examiner& examiner) {
  constexpr const char* kName = "remembers_particles is honest";
  if (cloud.force().internal_size() == 0) return;
  cloud.place(0, 0);
  const std::vector<double> rates = cloud.memory_rates();
  examiner.check("its memory changes by finite rates", finite(rates),
                 std::to_string(cloud.force().internal_size()) + " numbers");
  cloud.place(1, 0);
  const bool equal = same(rates, cloud.memory_rates());
  if (cloud.force().internal_depends_on_particles())
    examiner.ok(kName, equal ? "it says it does; on these states it does not: verlet could run it"
                             : "it does");
  else
    examiner.check(kName, equal, equal ? "it does not" : "it says it does not, but it does");
}

void check_momentum(Cloud& cloud, Examiner& examiner) {
  cloud.place(2, 0);
  const std::vector<double> forces = cloud.forces();
  double sum[3] = {}, size = 0;
  for (std::size_t i = 0; i < forces.size(); ++i) {
    sum[3 * i / forces.size()] += forces[i];
    size += std::fabs(forces[i]);
  }
  const double rest = std::fabs(sum[0]) + std::fabs(sum[1]) + std::fabs(sum[2]);
  examiner.ok("momentum", rest <= 1e-12 * size ? "the forces sum to 0: an internal force"
                                               : "the forces do not sum to 0: an external force");
}

// Checks for allocations in a state evaluated before, and in another one.
void check_allocations(Cloud& cloud, Examiner& examiner) {
  for (const int state : {1, 2, 1}) {
    cloud.place(state, 0);
    cloud.evaluate();
  }
  examiner.allocations("an evaluation", [&] {
    cloud.evaluate();
    cloud.place(2, 0);
    cloud.evaluate();
  });
}

void check_purity(const ForcePlugin& plugin, const Params& params, Examiner& examiner) {
  Cloud one(plugin, params, kMany, 1);
  one.place(1, 0);
  const std::vector<double> first = one.forces();
  one.place(2, 0);
  one.forces();
  one.place(1, 0);
  examiner.check("the same bits again", same(first, one.forces()), "with another state between");
  examiner.check("finite", finite(first), std::to_string(kMany) + " particles");
  examiner.hash(first);

  std::string wrong;
  for (int threads = 2; threads <= 4; ++threads) {
    Cloud many(plugin, params, kMany, threads);
    many.place(1, 0);
    if (!same(first, many.forces())) wrong += (wrong.empty() ? "" : ", ") + std::to_string(threads);
  }
  examiner.check("the same bits on 1 to 4 threads", wrong.empty(),
                 wrong.empty() ? std::to_string(kMany) + " particles" : "not on " + wrong);
  constexpr const char* kTiles = "the same bits in other tiles";
  if (one.force().affine() || one.force().springs())
    return examiner.skipped(kTiles, "it is affine or made of springs");
  const std::vector<double> whole = one.in_tiles(kMany);
  for (const int size : {1, 8, 1000})
    if (!same(whole, one.in_tiles(size)))
      return examiner.failed(kTiles, "not in tiles of " + std::to_string(size));
  if (one.force().sweep())
    for (const int from : {0, 1600}) {
      std::vector<double> rest = whole;
      for (int axis = 0; axis < 3; ++axis)
        std::fill_n(rest.begin() + axis * static_cast<std::ptrdiff_t>(kMany), from, 0.0);
      for (const int size : {8, 1000})
        if (!same(rest, one.swept(from, size)))
          return examiner.failed(kTiles, "not swept in tiles of " + std::to_string(size) +
                                             " from particle " + std::to_string(from));
    }
  examiner.ok(kTiles, "of 1, 8 and 1000 particles");
}

// Checks the force with parameters turned on that its defaults turn off, such as damping 0.
void check_turned_on(const ForcePlugin& plugin, Examiner& examiner) {
  for (const Param& param : plugin.params) {
    const auto* const value = std::get_if<double>(&param.default_value);
    if (!value || *value != 0 || param.min != 0) continue;
    std::map<std::string, Value> given = example_values(plugin);
    given[param.name] = std::min(0.5, param.max);
    const Params params(plugin.title(), plugin.params, given, {}, plugin.free_numbers);
    Cloud cloud(plugin, params, kFew, 1);
    check_jacobian(cloud, examiner, ", with " + param.name);
  }
}

}  // namespace

void check_force(const ForcePlugin& plugin, Contract& contract) {
  Examiner examiner(plugin, contract);
  examiner.group("evaluates", [&] {
    const Params params = example_params(plugin);
    Cloud cloud(plugin, params, kFew, 1);
    check_potential(cloud, examiner);
    check_jacobian(cloud, examiner);
    check_couplings(cloud, examiner);
    check_velocity(cloud, examiner);
    check_memory(cloud, examiner);
    check_momentum(cloud, examiner);
    check_allocations(cloud, examiner);
    check_purity(plugin, params, examiner);
    check_turned_on(plugin, examiner);
  });
  examiner.bounds([&](const Params& params) { return Cloud(plugin, params, kFew, 1).forces(); });
}

}  // namespace sim::study::contract
