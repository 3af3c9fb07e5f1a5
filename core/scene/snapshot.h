// A snapshot, from which a simulation continues bit for bit, and the parts of a force.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/plugin/registry.h"

namespace sim {

// The settings by which a system is stepped, apart from its state. Immutable once a snapshot shares
// them.
struct Settings {
  Method method;
  double h = 0;                  // s
  std::vector<int> pinned;       // ids, ascending
  std::vector<std::string> off;  // switches of the scene that are off, in order of their names
  std::vector<int> held = {};    // by a user: ids, ascending; they may be pinned, too
  // Broken ties: indices among the breakable ties of all forces, in the order of the forces,
  // ascending; and the energy that was in them when they broke, J.
  std::vector<int> broken = {};
  double broken_energy = 0;

  std::vector<int> fixed() const;  // pinned or held
};

// The state after `step` steps. With a step size that changed at step n0 and time t0 the time of
// step n is t0 + (n - n0) h: nothing accumulates.
struct Snapshot {
  std::shared_ptr<const Settings> settings;
  std::int64_t step = 0, n0 = 0;
  double t0 = 0;               // s
  std::vector<double> x;       // X, in the layout of the system
  std::vector<double> memory;  // Integrator::memory()

  double t() const { return t0 + static_cast<double>(step - n0) * settings->h; }
  std::size_t bytes() const {
    return sizeof *this + sizeof *settings + (x.size() + memory.size()) * sizeof(double) +
           (settings->pinned.size() + settings->held.size() + settings->broken.size()) *
               sizeof(int);
  }
};

// The force of one plugin, or one family of springs, on one particle.
struct ForceShare {
  std::string name;  // of the family, or of the plugin
  Vec3 force;        // N
};

}  // namespace sim
