// The contact of a scene, as plain data.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/geometry/triangle_mesh.h"
#include "core/plugin/params.h"

namespace sim {

// Surfaces, as `sim.contact` lists them. Values equal to the plugin's default are left out.
struct ContactSpec {
  std::vector<std::shared_ptr<const TriangleMesh>> surfaces = {};
  std::map<std::string, Value> given = {};
  std::string plugin = "surfaces";
  SourceLocation place = {};
};

}  // namespace sim
