#include "tests/support/scenes.h"

#include <cmath>
#include <cstring>
#include <stdexcept>

#include <numbers>
#include "core/particles/step_correction.h"

namespace sim_test {

sim::Registry make_registry() { return sim::Registry({SIM_PLUGIN_DIR}); }

sim::PartSpec make_part(const std::string& plugin, std::map<std::string, sim::Value> given) {
  sim::PartSpec part;
  part.plugin = plugin;
  part.given = std::move(given);
  return part;
}

sim::PartSpec make_gravity() { return make_part("gravity", {{"g", sim::Vec3(0, -kGravity, 0)}}); }

sim::PartSpec make_drag(double k) { return make_part("drag", {{"k", k}}); }

sim::PartSpec make_springs(const std::string& family, double stiffness) {
  return make_part("spring", {{"family", family}, {"stiffness", stiffness}});
}

namespace {

sim::PartSpec make_grid_springs(int n, const std::string& family, double stiffness,
                                const std::vector<std::pair<int, int>>& offsets) {
  sim::PartSpec part = make_springs(family, stiffness);
  for (const auto& [di, dj] : offsets) {
    sim::GridPairs pairs{.size = {n, n, 1}, .step = {di, dj, 0}};
    pairs.length = std::sqrt(static_cast<double>(di * di + dj * dj)) / n;
    part.elements.grids.push_back(pairs);
  }
  return part;
}

sim::SystemSpec make_system(const std::string& name) {
  sim::SystemSpec spec;
  spec.name = name;
  spec.integrator = "rk4";
  spec.dt = 0.005;
  spec.duration = 1;
  return spec;
}

}  // namespace

sim::SystemSpec make_cloth(int n, const ClothOptions& options) {
  const double side = 1.0 / n, mass = 1.0 / (static_cast<double>(n) * n);
  sim::SystemSpec spec = make_system("cloth");
  spec.particles.emplace();
  spec.particles->grid =
      sim::GridSpec{.size = {n, n, 1}, .du = {0, 0, side}, .dv = {side, 0, 0}, .mass = mass};
  if (options.pinned) spec.particles->pinned = {0, n - 1};
  if (options.gravity) spec.forces.push_back(make_gravity());
  if (options.drag > 0) spec.forces.push_back(make_drag(options.drag * mass));
  spec.forces.push_back(make_grid_springs(n, "structural", 100, {{0, 1}, {1, 0}}));
  spec.forces.push_back(make_grid_springs(n, "shear", 50, {{1, 1}, {1, -1}}));
  spec.forces.push_back(make_grid_springs(n, "flex", 25, {{0, 2}, {2, 0}}));
  return spec;
}

sim::SystemSpec make_circle() {
  sim::SystemSpec spec = make_system("circle");
  spec.first_order = sim::FirstOrderSpec{
      .dimension = 3, .state = {1, 0, 0}, .field = make_part("rotation", {{"omega", 1.0}})};
  return spec;
}

namespace {

sim::SystemSpec make_pendulum(const sim::ParticleSpec& bob, double stiffness, double drag) {
  sim::SystemSpec spec = make_system("pendulum");
  spec.particles.emplace();
  spec.particles->list = {sim::ParticleSpec{}, bob};
  spec.particles->pinned = {0};
  spec.forces = {make_gravity(), make_springs("link", stiffness)};
  spec.forces.back().elements.add({0, 1}, {{"rest", 1}});
  if (drag > 0) spec.forces.push_back(make_drag(drag));
  return spec;
}

}  // namespace

sim::SystemSpec make_vertical_spring(double drag) {
  return make_pendulum({.position = {0, -1, 0}}, 49, drag);
}

sim::SystemSpec make_elastic_pendulum(double drag) {
  return make_pendulum({.position = {0.6, -0.9, 0.3}, .velocity = {0.2, 0.1, -0.5}}, 40, drag);
}

sim::SystemSpec make_chain(const std::vector<sim::Vec3>& points, std::vector<int> pinned,
                           double drag) {
  sim::SystemSpec spec = make_system("chain");
  spec.particles.emplace();
  spec.particles->pinned = std::move(pinned);
  sim::PartSpec springs = make_springs("link", 400);
  for (int i = 0; i < static_cast<int>(points.size()); ++i) {
    spec.particles->list.push_back({.position = points[static_cast<std::size_t>(i)], .mass = 0.25});
    if (i > 0) springs.elements.add({i - 1, i}, {{"rest", 0.25}});
  }
  spec.forces = {make_gravity(), springs};
  if (drag > 0) spec.forces.push_back(make_drag(drag));
  return spec;
}

sim::SystemSpec make_row(int mode, double amplitude) {
  constexpr int kFree = 10;
  sim::SystemSpec spec = make_system("row");
  spec.particles.emplace();
  spec.particles->pinned = {0, kFree + 1};
  sim::PartSpec springs = make_springs("link", 100);
  for (int j = 0; j <= kFree + 1; ++j) {
    const bool end = j == 0 || j == kFree + 1;
    const double shift = amplitude * std::sin(mode * j * std::numbers::pi / (kFree + 1));
    spec.particles->list.push_back({.position = {j + (end ? 0 : shift), 0, 0}, .mass = 0.1});
    if (j > 0) springs.elements.add({j - 1, j}, {{"rest", 1}});
  }
  spec.forces = {springs};
  return spec;
}

sim::SystemSpec make_lorenz() {
  sim::SystemSpec spec;
  spec.name = "lorenz";
  const sim::OdeFunction f = [](double, std::span<const double> x, std::span<double> dxdt) {
    dxdt[0] = 10 * (x[1] - x[0]);
    dxdt[1] = x[0] * (28 - x[2]) - x[1];
    dxdt[2] = x[0] * x[1] - 8.0 / 3 * x[2];
  };
  spec.first_order = sim::FirstOrderSpec{1, {1, 1, 1}, make_part("lua", {{"f", f}})};
  spec.integrator = "rk4";
  spec.dt = 0.01;
  return spec;
}

sim::SystemSpec make_falling(double mass, double drag) {
  sim::SystemSpec spec = make_system("falling");
  spec.particles.emplace();
  spec.particles->list = {{.position = {0.5, 2, -1}, .velocity = {1, 3, -2}, .mass = mass}};
  spec.forces = {make_gravity()};
  if (drag > 0) spec.forces.push_back(make_drag(drag));
  return spec;
}

sim::SystemSpec make_particle(const sim::Vec3& position, const sim::Vec3& velocity,
                              sim::PartSpec collider, bool gravity) {
  sim::SystemSpec spec = make_falling(1, 0);
  spec.particles->list[0] = {.position = position, .velocity = velocity, .mass = 1};
  if (!gravity) spec.forces.clear();
  spec.colliders = {std::move(collider)};
  return spec;
}

sim::PartSpec make_sphere(double friction) {
  return make_part("sphere", {{"radius", 1.0}, {"friction", friction}});
}

sim::PartSpec make_slope(double angle, double friction) {
  const sim::Vec3 normal(-std::sin(angle), std::cos(angle), 0);
  return make_part("plane", {{"normal", normal}, {"friction", friction}});
}

sim::IntegratorInfo info_of(const std::string& integrator, sim::Registry& registry) {
  return sim::Method(registry, integrator).make()->info();
}

sim::RunOptions fixed_steps(const std::string& integrator, double dt, sim::Registry& registry) {
  sim::RunOptions options{.integrator = integrator, .dt = dt};
  for (const sim::Param& param : registry.get<sim::Integrator>(integrator).params)
    if (param.name == "fixed_step") options.integrator.given["fixed_step"] = true;
  return options;
}

std::vector<std::string> methods_for(const sim::SystemSpec& spec, sim::Registry& registry) {
  std::vector<std::string> names = registry.names<sim::Integrator>();
  if (!spec.particles)
    std::erase_if(
        names, [&](const std::string& name) { return info_of(name, registry).needs_second_order; });
  // Systems of many particles are refused by rodas4.
  std::erase_if(names, [&](const std::string& name) {
    if (name != "rodas4") return false;
    try {
      sim::Simulation(spec, registry, {.integrator = name, .dt = spec.dt > 0 ? spec.dt : 1});
    } catch (const sim::Error&) {
      return true;
    }
    return false;
  });
  return names;
}

std::vector<std::string> methods_with_order(const sim::SystemSpec& spec, sim::Registry& registry) {
  std::vector<std::string> names = methods_for(spec, registry);
  // auto has no order yet, and bdf goes from one to the other.
  std::erase_if(names, [&](const std::string& name) {
    return name == "bdf" || info_of(name, registry).order == 0;
  });
  return names;
}

bool run(sim::Simulation& simulation, std::int64_t n) {
  for (std::int64_t i = 0; i < n; ++i)
    if (!simulation.step()) return false;
  return true;
}

std::vector<double> state_of(const sim::Simulation& simulation) {
  std::vector<double> state;
  for (int i = 0; i < simulation.particles() && simulation.second_order(); ++i) {
    const sim::Vec3 x = simulation.position(i), v = simulation.velocity(i);
    state.insert(state.end(), {x[0], x[1], x[2], v[0], v[1], v[2]});
  }
  if (!simulation.second_order())
    for (int i = 0; i < simulation.components(); ++i) state.push_back(simulation.component(i));
  return state;
}

bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

double figure_of(const sim::Simulation& simulation, const std::string& name) {
  double sum = 0;
  bool found = false;
  for (const auto& correction : simulation.corrections())
    for (const auto& [own, value] : correction->account().figures)
      if (own == name) sum += value, found = true;
  if (!found) throw std::runtime_error("no correction accounts for " + name);
  return sum;
}

}  // namespace sim_test
