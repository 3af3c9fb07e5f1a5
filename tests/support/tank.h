// Rooms with water.
#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <string>

#include "tests/support/scenes.h"

namespace sim_test {

using sim::Vec3;

// Water in the corner of a room, in two dimensions (nz = 0) or three.
struct Tank {
  int nx = 10, ny = 20, nz = 0;
  double spacing = 0.02, length = 0.2;  // m; length of the room
  double alpha = 0.05, sound = 30;
  std::string integrator = "verlet";
  std::string solver = "wcsph";
};

inline sim::SystemSpec make_tank(const Tank& tank, sim::Registry& registry) {
  const double a = tank.spacing, depth = tank.nz > 0 ? tank.nz * a : 100;
  sim::SystemSpec spec = make_falling(1, 0);
  spec.integrator.name = tank.integrator;
  spec.dt = (tank.solver == "dfsph" ? 5 : 1) * 0.4 * 1.5 * a / tank.sound;
  spec.particles->list.clear();
  const double mass = 1000 * a * a * (tank.nz > 0 ? a : 1);
  for (int i = 0; i < tank.nx; ++i)
    for (int j = 0; j < tank.ny; ++j)
      for (int k = 0; k < std::max(1, tank.nz); ++k)
        spec.particles->list.push_back(
            {a * Vec3(i + 0.5, j + 0.5, tank.nz > 0 ? k + 0.5 : 0), Vec3(0, 0, 0), mass});
  const std::map<std::string, sim::Value> room{
      {"half", Vec3(0.5 * tank.length, 5, 0.5 * depth)},
      {"center", Vec3(0.5 * tank.length, 5, tank.nz > 0 ? 0.5 * depth : 0)},
      {"thickness", 0.25 * a},  // the mirrors are as far behind that
      {"inside", true}};
  spec.colliders = {make_part("box", room)};
  const auto& box = registry.get<sim::Collider>("box");
  auto maker = std::make_shared<sim::ColliderMaker>();
  maker->make = [&box, room] { return box.make(sim::Params(box.title(), box.params, room, {})); };
  spec.forces.push_back(make_part("fluid", {{"density", 1000.0},
                                            {"speed_of_sound", tank.sound},
                                            {"alpha", tank.alpha},
                                            {"solver", tank.solver},
                                            {"dimensions", std::int64_t{tank.nz > 0 ? 3 : 2}},
                                            {"boundary", sim::Colliders{maker}}}));
  return spec;
}

}  // namespace sim_test
