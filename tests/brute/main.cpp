// sim_brute [N [SCENE [MS]]]: cloth of N x N particles (64) in all that may make it cross itself,
// at steps of 1 to 20 ms, or in one scene, at one step; crossings are counted over all pairs. A row
// a run; exit code 1 where one crosses.
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <map>
#include <random>

#include "core/lua/scene/scene_file.h"
#include "tests/support/sheets.h"

using namespace sim_test;
using sim::Vec3;

namespace {

constexpr int kCounts = 6;  // of crossings in a run

using Steps = std::vector<double>;  // s

struct Run {
  std::int64_t steps = 0, crossings = 0;
  std::string end = "";
};

Run made(const sim::SystemSpec& spec, const sim::RunOptions& options, double duration) {
  sim::Registry registry = make_registry();
  sim::Simulation system(spec, registry, options);
  const std::int64_t steps = system.steps_for(duration);
  Run run;
  for (; run.steps < steps; ++run.steps) {
    if (!system.step()) {
      run.end = system.divergence().why.empty() ? "diverged" : system.divergence().why;
      break;
    }
    if ((run.steps + 1) % std::max<std::int64_t>(1, steps / kCounts) == 0)
      run.crossings += crossings(system, spec);
  }
  run.crossings += crossings(system, spec);
  return run;
}

class Table {
 public:
  explicit Table(std::string name) : name_(std::move(name)) {}
  void add(double dt, const sim::SystemSpec& spec, double duration, const std::string& method) {
    const auto start = std::chrono::steady_clock::now();
    const Run run = made(spec, {.integrator = {method}, .dt = dt}, duration);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    std::cout << name_ << "  dt " << 1000 * dt << " ms  " << method << "  steps " << run.steps
              << "  crossings " << run.crossings << "  " << took.count() << " s  " << run.end
              << std::endl;
    crossings_ += run.crossings;
  }
  std::int64_t crossings() const { return crossings_; }

 private:
  std::string name_;
  std::int64_t crossings_ = 0;
};

// Springs so stiff that verlet is stable with this step.
std::string stiffness_at(double dt, int n, double most) {
  return std::to_string(std::min(most, 0.02 / (n * n * dt * dt)));
}

std::int64_t scene(const Steps& all, const std::string& name, int n, double most, double duration,
                   std::map<std::string, std::string> settings = {}) {
  Table table(name);
  for (const double dt : all) {
    settings["n"] = std::to_string(n);
    settings["stiffness"] = stiffness_at(dt, n, most);
    sim::Registry registry = make_registry();
    const sim::SceneSpec spec = sim::load_scene("scenes/" + name + ".lua", registry,
                                                {{SIM_SOURCE_DIR "/scripts"}, settings, 0});
    table.add(dt, spec.systems[0], duration, "verlet");
  }
  return table.crossings();
}

std::int64_t crosswise(const Steps& all, int n) {
  Table table("two sheets crosswise");
  for (const double dt : all) {
    const double k = std::min(100.0, 0.02 / (n * n * dt * dt));
    sim::SystemSpec spec =
        make_sheets(2, {.n = n, .stiffness = k}, [](int sheet, double u, double v) {
          const Vec3 at(u - 0.5, 0.05 + 0.1 * sheet, v - 0.5);
          return sheet == 0
                     ? at
                     : Vec3(0.866 * at.x() - 0.5 * at.z(), at.y(), 0.5 * at.x() + 0.866 * at.z());
        });
    spec.forces.push_back(make_gravity());
    spec.forces.push_back(make_drag(0.5 / (n * n)));
    spec.colliders = {make_part("sphere", {{"radius", 0.2}, {"center", Vec3(0, -0.2, 0)}}),
                      make_part("plane", {{"point", Vec3(0, -0.4, 0)}, {"friction", 0.3}})};
    table.add(dt, spec, 1, "verlet");
  }
  return table.crossings();
}

std::int64_t crumples(const Steps& all, int n, int count) {
  Table table("crumple");
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int trial = 0; trial < count; ++trial) {
    const double dt = all[static_cast<std::size_t>(trial) % all.size()];
    double a[4];
    for (double& number : a) number = uniform(random);
    const double k = std::min(20.0, 0.02 / (n * n * dt * dt)), speed = 1 + trial % 4;
    sim::SystemSpec spec = make_sheets(1, {.n = n, .stiffness = k}, [&](int, double u, double v) {
      return Vec3(u - 0.5, 0.1 * (a[0] * std::sin(5 * u) + a[1] * std::sin(6 * v)), v - 0.5);
    });
    for (auto& particle : spec.particles->list) {
      const Vec3 x = particle.position;
      particle.velocity =
          -speed * x + 0.3 * speed * Vec3(uniform(random), 0, 0) +
          speed * Vec3(0, a[2] * std::sin(9 * x.x()) + a[3] * std::sin(7 * x.z()), 0);
    }
    table.add(dt, spec, 0.6, "verlet");
  }
  return table.crossings();
}

}  // namespace

int main(int argc, char** argv) {
  const int n = argc > 1 ? std::max(8, std::atoi(argv[1])) : 64;
  const std::string only = argc > 2 ? argv[2] : "";
  const Steps steps = argc > 3 ? Steps{1e-3 * std::atof(argv[3])} : Steps{0.001, 0.005, 0.02};
  std::int64_t all = 0;
  const auto add = [&](const std::string& name, const auto& count) {
    if (only.empty() || only == name) all += count(name);
  };
  add("crumple", [&](const std::string&) { return crumples(steps, n, 100); });
  add("crosswise", [&](const std::string&) { return crosswise(steps, n); });
  add("twist", [&](const std::string& name) { return scene(steps, name, n, 200, 2.5); });
  add("fold", [&](const std::string& name) { return scene(steps, name, n, 100, 3.4); });
  add("ring", [&](const std::string& name) { return scene(steps, name, n + 1, 200, 1.5); });
  add("drape_self", [&](const std::string& name) { return scene(steps, name, n, 200, 1.2); });
  std::cout << (all == 0 ? "no crossing\n" : std::to_string(all) + " crossings\n");
  return all == 0 ? 0 : 1;
}
