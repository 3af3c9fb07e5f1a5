#include "tests/bench/cloth.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <random>
#include <vector>

#include "core/lua/scene/scene_file.h"

namespace sim_bench {
namespace {

// 0 .. count - 1 in an order that is the same everywhere: std::shuffle is not.
std::vector<int> random_order(int count) {
  std::vector<int> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  std::mt19937_64 random(20240229);
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random() % i]);
  return order;
}

// Particle i of the cloth gets the id order[i].
void renumber(sim::ParticlesSpec& particles, const std::vector<int>& order) {
  const int n = particles.count();
  std::vector<sim::ParticleSpec> list(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i)
    list[static_cast<std::size_t>(order[static_cast<std::size_t>(i)])] = particles.at(i);
  particles.grid.reset();
  particles.list = std::move(list);
  for (int& id : particles.pinned) id = order[static_cast<std::size_t>(id)];
}

}  // namespace

sim::Registry make_registry() { return sim::Registry({SIM_BENCH_PLUGINS}); }

sim::SystemSpec load_cloth(int n, sim::Registry& registry) {
  sim::SceneOptions options;
  options.search_path = {SIM_BENCH_SCRIPTS};
  options.settings = {{"n", std::to_string(n)}};
  return sim::load_scene("scenes/cloth.lua", registry, options).systems.front();
}

sim::SystemSpec load_gas(int n, sim::Registry& registry) {
  sim::SceneOptions options;
  options.search_path = {SIM_BENCH_SCRIPTS};
  options.settings = {
      {"n", std::to_string(n)}, {"spacing", "1.0772173450159419"}, {"smooth", "energy"}};
  sim::SystemSpec spec = sim::load_scene("scenes/gas.lua", registry, options).systems.front();
  spec.forces.front().given.insert({{"cutoff", 2.5}, {"skin", 0.3}});
  return spec;
}

sim::SystemSpec tied_cloth(const sim::SystemSpec& cloth, Ties ties) {
  sim::SystemSpec spec = cloth;
  const int n = spec.particles->count();
  std::vector<int> order(static_cast<std::size_t>(n));
  std::iota(order.begin(), order.end(), 0);
  if (ties == Ties::kShuffled) {
    order = random_order(n);
    renumber(*spec.particles, order);
  }

  sim::PartSpec all;
  all.plugin = "spring";
  std::mt19937_64 random(7);
  for (const sim::PartSpec& part : cloth.forces) {
    if (part.elements.empty()) continue;
    const double stiffness = number_of(part.given.at("stiffness"));
    part.elements.for_each([&](const sim::Element& tie) {
      const double unit = static_cast<double>(random() >> 11) * 0x1p-53;
      const double jitter = ties == Ties::kJittered ? 1 + 1e-3 * (unit - 0.5) : 1;
      all.elements.add({order[static_cast<std::size_t>(tie.ids[0])],
                        order[static_cast<std::size_t>(tie.ids[1])]},
                       {{"stiffness", stiffness}, {"rest", tie.length * jitter}});
    });
  }
  std::erase_if(spec.forces, [](const sim::PartSpec& part) { return !part.elements.empty(); });
  spec.forces.push_back(std::move(all));
  return spec;
}

sim::SystemSpec springs_only(sim::SystemSpec spec) {
  std::erase_if(spec.forces, [](const sim::PartSpec& part) { return part.elements.empty(); });
  return spec;
}

double number_of(const sim::Value& value) {
  if (const auto* const whole = std::get_if<std::int64_t>(&value))
    return static_cast<double>(*whole);
  return std::get<double>(value);
}

long count_springs(const sim::SystemSpec& spec) {
  long count = 0;
  for (const sim::PartSpec& part : spec.forces) count += static_cast<long>(part.elements.count());
  return count;
}

double stable_step(const std::string& integrator, int n) {
  const double omega = std::sqrt(1400.0) * n, drag = 2;  // 1/s
  // |1 + h lambda| <= 1 for lambda^2 + drag lambda + omega^2 = 0 up to h = drag / omega^2.
  if (integrator == "euler") return 0.5 * drag / (omega * omega);
  // Grows by (h omega)^4 / 8 a step where the drag takes away h drag / 2.
  if (integrator == "trapezoid") return std::min(0.05, std::cbrt(4 * drag / omega) / 2) / omega;
  // A quarter of the interval [0, 2.83] of rk4 or [0, 2] of the splitting methods, or of the 2 that
  // any other method may be hoped to have.
  return (integrator == "rk4" ? 0.7 : 0.5) / omega;
}

sim::RunOptions run_options(const sim::MethodChoice& choice, int n, sim::Registry& registry) {
  return {.integrator = sim::cli::typed(choice, choice.name, registry),
          .dt = stable_step(choice.name, n)};
}

}  // namespace sim_bench
