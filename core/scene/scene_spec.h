// A scene as plain data: the contents of a Lua file (or of a C++ caller), before compilation.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/input_file.h"
#include "core/particles/contacts.h"
#include "core/plugin/elements.h"
#include "core/plugin/method.h"
#include "core/plugin/params.h"
#include "core/scene/contact_spec.h"
#include "core/scene/particles_spec.h"
#include "core/scene/rigid_spec.h"

namespace sim {

// One `sim.force.NAME{...}` or `sim.field.NAME{...}` of a scene; values not yet checked against the
// plugin's declaration.
struct PartSpec {
  std::string plugin;
  std::map<std::string, Value> given;
  Elements elements = {};
  std::optional<std::vector<int>> particles = {};  // ascending: on these alone; none: on all
  SourceLocation place = {};
  std::string switch_name = {};    // empty: it cannot be turned on and off
  bool on = true;                  // at the start
  std::optional<bool> stiff = {};  // of a force: implicit, or explicit, in methods that choose
};

// State of a first-order scene: points of space (dimension 3) or a flat list (dimension 1).
struct FirstOrderSpec {
  int dimension = 3;
  std::vector<double> state;  // x0 y0 z0 x1 ...
  PartSpec field;
};

// The look of pictures of a run, as options of the command line give it; empty: not given.
struct LookSpec {
  std::string camera;                // "eye=1,1,3 at=0,0,0 up=0,1,0 fov=40", or parts of it
  std::string color;                 // "strain", "speed:2"
  std::string size;                  // "1280x720"
  std::vector<std::string> springs;  // of a particle, a family, or "all"
  bool wireframe = false, surface = false;
  std::vector<std::string> trails;  // of a particle, "body:0", or "none"

  bool empty() const {
    return camera.empty() && color.empty() && size.empty() && springs.empty() && !wireframe &&
           !surface && trails.empty();
  }
};

class Simulation;

// A quantity observed by the scene. Not finite: not known. May throw Error{kScene}.
struct ObserverSpec {
  std::string name;
  std::function<double(const Simulation&)> value;
};

// An allowed error of a run, of positions or of the numbers of a flat state: a share of the size of
// the scene, or in m.
struct AllowedError {
  double value = 0;
  bool in_metres = false;
};

// Sleeping: islands, the particles that elements join, take no steps once they have rested.
struct SleepSpec {
  double energy = 0;   // J, > 0: the kinetic energy of an island at rest stays below it
  double after = 0.5;  // s, > 0: for so long
};

// One system. Either `particles` with forces (second order) or `first_order`.
struct SystemSpec {
  std::string name;
  std::optional<ParticlesSpec> particles;
  std::vector<PartSpec> forces, colliders, constraints;
  Accuracy accuracy = Accuracy::kSettle;  // of contact with colliders
  std::vector<RigidSpec> bodies;          // see place_bodies()
  std::vector<BodyPoint> points;          // that elements name
  std::vector<std::shared_ptr<const TriangleMesh>> surfaces;
  std::optional<ContactSpec> contact;
  std::string body_contact = "bodies";  // the plugin by which bodies touch
  std::vector<Vec3> loads;              // N, a constant force on each particle; empty = none
  std::optional<FirstOrderSpec> first_order;

  MethodChoice integrator;
  double dt = 0;                      // s, > 0
  double duration = 0;                // s, >= 0
  std::optional<AllowedError> error;  // method and step of a run are then chosen to keep it
  std::optional<SleepSpec> sleep;     // none: all take all steps
  SourceLocation place;
  // Exact solution, if the scene has one: the state (as in FirstOrderSpec::state, or the positions
  // of the particles) at time t.
  std::function<std::vector<double>(double t)> exact;
  bool one_thread = false;  // its steps call functions that know no threads
  LookSpec look;
  std::vector<ObserverSpec> observers;                          // by name
  std::vector<double> observe(const Simulation& system) const;  // the value of each observable
};

// Gives the particles of cells the mass of these, if their force has a parameter `density`: a share
// of rho V of each cell to each of its particles, by lumped_mass().
void weigh_cells(SystemSpec& spec);

// A parameter of the scene itself: sim.arg(name, default, doc).
struct SceneArg {
  std::string name;
  Value default_value, value;  // bool, number (double) or text
  std::string doc;
};

// The value that a scene file returns. A file with one scene has one system; a sim.world has
// several, in the order of their names, and `world` is true.
struct SceneSpec {
  std::string file;  // the file it was found at
  std::vector<SystemSpec> systems;
  std::vector<SceneArg> args;
  bool world = false;
  std::vector<std::string> notes = {};  // for the user, on the text of the scene
  std::vector<InputFile> inputs;  // the Lua files it was made of, and where others were searched
};

}  // namespace sim
