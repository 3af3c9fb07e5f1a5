// Meshes that other programs write: .obj, and .ply in text or little-endian binary.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/math/vec3.h"

namespace sim::engine {

struct Mesh {
  std::vector<Vec3> points;  // the points of triangles, in the order of the file
  std::vector<std::array<int, 3>> triangles;
  int dropped = 0;  // triangles without an area, of fewer than three points
};

// Polygons become fans of triangles. Throws Error{kIo} for a file that cannot be read, and
// Error{kUsage} with the line or byte for what is no such mesh.
Mesh read_mesh(const std::string& file);

}  // namespace sim::engine
