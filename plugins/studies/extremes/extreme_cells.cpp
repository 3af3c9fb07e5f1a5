#include "extreme_cells.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/math/elementary.h"

namespace sim::study {
namespace {

constexpr int kExtremeSteps = 60;
constexpr double kGravity = 9.81;     // m/s^2
constexpr double kMostRadians = 1e3;  // of a run with steps of the method's own; fewer far away,
constexpr double kFarRadians = 50;    // if rounding makes such steps small

SystemSpec hanging_particle(double stiffness, double mass, double offset) {
  SystemSpec spec;
  spec.name = "extreme";
  spec.integrator = "rk4";
  spec.dt = 1;
  spec.particles.emplace();
  const Vec3 origin = Vec3::Constant(offset);
  spec.particles->list = {{.position = origin}, {.position = origin - Vec3(0, 1, 0), .mass = mass}};
  spec.particles->pinned = {0};
  PartSpec gravity, spring;
  gravity.plugin = "gravity";
  gravity.given = {{"g", Vec3(0, -kGravity, 0)}};
  spring.plugin = "spring";
  spring.given = {{"stiffness", stiffness}};
  spring.elements.add({0, 1}, {{"rest", 1}});
  spec.forces = {gravity, spring};
  return spec;
}

// The fall of the particle at t: 2 m g / k sin^2(w t / 2), without cancellation.
double moved(const ExtremeCell& cell, double t) {
  const double half = 0.5 * std::sqrt(cell.stiffness / cell.mass) * t;
  if (half < 1e-4) return 0.5 * kGravity * t * t;
  const double sine = elementary::sin(half);
  return 2 * cell.mass * kGravity / cell.stiffness * sine * sine;
}

// Runs the cell and judges it as sim would, then compares with the exact motion.
void run_cell(Registry& registry, const MethodChoice& integrator, ExtremeCell& cell) {
  const SystemSpec spec = hanging_particle(cell.stiffness, cell.mass, cell.offset);
  try {
    Simulation system(spec, registry, {.integrator = integrator, .dt = cell.dt});
    const double radians = std::sqrt(cell.stiffness / cell.mass) * cell.dt * kExtremeSteps;
    const double most = cell.offset > 1e9 ? kFarRadians : kMostRadians;
    const bool own =
        system.integrator_info().adaptive || std::isnan(system.integrator().amplification(0.1, 0));
    if (own && radians > most) {
      cell.reason = "too many steps of its own";
      return;
    }
    cell.run = true;
    Monitor monitor(spec, system, kExtremeSteps, &registry);
    double way = 1;
    for (int step = 0; step <= kExtremeSteps; ++step) {
      if (step > 0 && !system.step()) {
        cell.trust = Trust::kDiverged;
        cell.reason = "step " + std::to_string(step) + " fails";
        return;
      }
      if (step > 0) monitor.advance();
      const Energy energy = system.energy();
      monitor.look(&energy);
      const double down = moved(cell, system.t());
      way = std::max(way, std::abs(down));
      const double error = std::abs(cell.offset - 1 - down - system.position(1).y());
      if (!(error <= cell.error)) cell.error = error;
    }
    cell.error /= way;
    const Verdict verdict = monitor.verdict();
    cell.trust = verdict.trust;
    cell.reason = verdict.reason;
  } catch (const Error& error) {
    cell.run = false;
    cell.reason = error.what();
  }
}

std::vector<double> powers(int from, int to, int stride) {
  std::vector<double> values;
  for (int power = from; power <= to; power += stride)
    values.push_back(elementary::pow(10.0, power));
  return values;
}

}  // namespace

Extremes extremes(Registry& registry, const std::vector<MethodChoice>& integrators,
                  const Watch& watch) {
  Extremes result;
  result.stiffness = powers(-6, 12, 3);
  result.mass = powers(-9, 9, 3);
  result.dt = powers(-12, 3, 3);
  result.offset = powers(3, 15, 3);
  const SystemSpec spec = hanging_particle(1, 1, 0);
  const std::vector<Candidate> methods = fitting_methods({&spec, &registry}, integrators);
  for (const Candidate& method : methods) {
    ExtremeMap& map = result.maps.emplace_back();
    map.method = method;
    const auto add = [&](double stiffness, double mass, double dt, double offset) {
      ExtremeCell& cell = map.cells.emplace_back();
      cell.stiffness = stiffness;
      cell.mass = mass;
      cell.dt = dt;
      cell.offset = offset;
    };
    for (const double stiffness : result.stiffness)
      for (const double mass : result.mass)
        for (const double dt : result.dt) add(stiffness, mass, dt, 0);
    for (const double offset : result.offset)
      for (const double dt : result.dt) add(1000, 1, dt, offset);
    for (std::size_t i = 0; i < map.cells.size(); ++i) {
      const double done = (static_cast<double>(result.maps.size() - 1) +
                           static_cast<double>(i) / static_cast<double>(map.cells.size())) /
                          static_cast<double>(methods.size());
      if (!watch(method.label, done)) {
        map.cells.resize(i);
        result.complete = false;
        return result;
      }
      run_cell(registry, method, map.cells[i]);
    }
  }
  return result;
}

}  // namespace sim::study
