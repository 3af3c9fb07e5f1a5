// A scene as plain data: what a Lua file (or a C++ caller) says, before anything is compiled.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/math/vec3.h"
#include "core/plugin/links.h"
#include "core/plugin/method.h"
#include "core/plugin/params.h"

namespace sim {

// Particles with ids first .. first + rows * cols - 1 at origin + i * du + j * dv, id i * cols + j.
struct GridSpec {
  int rows = 0, cols = 0;
  Vec3 origin = Vec3::Zero(), du = Vec3::Zero(), dv = Vec3::Zero();
  double mass = 1;  // kg, each
};

struct ParticleSpec {
  Vec3 position = Vec3::Zero();  // m
  Vec3 velocity = Vec3::Zero();  // m/s
  double mass = 1;               // kg
};

// Ids run over the grid first (if there is one), then over the list.
struct ParticlesSpec {
  std::optional<GridSpec> grid;
  std::vector<ParticleSpec> list;
  std::vector<int> pinned;

  int count() const { return (grid ? grid->rows * grid->cols : 0) + static_cast<int>(list.size()); }
  ParticleSpec at(int id) const;
};

// One `sim.force.NAME{...}` or `sim.field.NAME{...}` of a scene; values not yet checked against the
// plugin's declaration.
struct PartSpec {
  std::string plugin;
  std::map<std::string, Value> given;
  Links links;
  Place place;
};

// State of a first-order scene: points of space (dimension 3) or a flat list (dimension 1).
struct FirstOrderSpec {
  int dimension = 3;
  std::vector<double> state;  // x0 y0 z0 x1 ...
  PartSpec field;
};

// One system. Either `particles` with forces (second order) or `first_order`.
struct SystemSpec {
  std::string name;
  std::optional<ParticlesSpec> particles;
  std::vector<PartSpec> forces;
  std::vector<Vec3> loads;  // N, a constant force on each particle; empty = none
  std::optional<FirstOrderSpec> first_order;

  MethodChoice integrator;
  double dt = 0;        // s, > 0
  double duration = 0;  // s, >= 0
  Place place;
  // Exact solution where the scene has one: the state (as in FirstOrderSpec::state, or the
  // positions of the particles) at time t.
  std::function<std::vector<double>(double t)> exact;
};

// A parameter of the scene itself: sim.arg(name, default, doc).
struct SceneArg {
  std::string name;
  Value default_value, value;  // bool, number (double) or text
  std::string doc;
};

// What a scene file returns. A file with one scene has one system; a sim.world has several, in the
// order of their names, and `world` is true.
struct SceneSpec {
  std::string file;  // the file it was found at
  std::vector<SystemSpec> systems;
  std::vector<SceneArg> args;
  bool world = false;
};

}  // namespace sim
