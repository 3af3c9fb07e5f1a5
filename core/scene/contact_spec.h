// Contact of surfaces as plain data.
#pragma once

#include <memory>
#include <vector>

#include "core/particles/elements/triangle_mesh.h"
#include "core/plugin/params.h"

namespace sim {

// Contact of surfaces with each other and themselves, as sim.contact says it.
struct ContactSpec {
  std::vector<std::shared_ptr<const TriangleMesh>> surfaces;
  double thickness = 0, friction = 0;  // m, > 0; Coulomb's, >= 0
  bool self = true;                    // each with itself, too
  double strain_limit = 0;             // of edges, a share of their first length; 0: none
  Place place = {};
};

}  // namespace sim
