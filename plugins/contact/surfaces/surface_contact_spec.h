// The parameters of contact between surfaces.
#pragma once

#include <memory>
#include <vector>

#include "core/geometry/triangle_mesh.h"
#include "core/particles/contact_law.h"

namespace sim {

struct SurfaceContactSpec {
  std::vector<std::shared_ptr<const TriangleMesh>> surfaces;
  double thickness = 0;           // m, > 0: the distance that layers keep
  ContactMaterial material = {};  // of the layers; its restitution is 0
  bool self = true;               // a surface touches itself, too
  double strain_limit = 0;  // > 0: edges get no longer than this share above their first length
};

}  // namespace sim
