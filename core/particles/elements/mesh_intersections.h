// Intersections of surfaces with each other and themselves.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/geometry/triangle_mesh.h"
#include "core/particles/elements/torn_faces.h"
#include "core/particles/view.h"

namespace sim {

// True if the inside of a segment crosses that of a triangle; contact to within rounding does not
// count.
bool segment_meets_triangle(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b,
                            const Vec3& c);

class MeshIntersections {
 public:
  // All surfaces together, on the same particles.
  explicit MeshIntersections(std::span<const std::shared_ptr<const TriangleMesh>> surfaces);

  // The number of intersecting pairs of an edge and a triangle without a common corner; contact to
  // within rounding does not count.
  std::int64_t count(const ParticleView& view);
  // The first intersection: the triangle of its edge, and the other one. Empty if there is none.
  std::vector<TriangleMesh::Triangle> first(const ParticleView& view);
  // Removes faces with such an edge, and edges that are torn or left without a face.
  void tear(std::span<const std::array<int, 2>> torn);
  std::size_t triangles() const { return triangles_.size(); }

 private:
  struct Reach {  // the box of a triangle
    Vec3 least, most;
  };
  struct Line {  // of the grid: cells along an axis
    int axis = 0, count = 1;
    double first = 0, inverse = 0, widest = 0;  // m; 1/m; m, of a box

    int cell(double x) const {
      const double place = (x - first) * inverse;
      return place >= count ? count - 1 : place > 0 ? static_cast<int>(place) : 0;
    }
  };

  bool sort(const ParticleView& view);
  // Calls found(edge, triangle) for each, as long as it returns true.
  template <class Found>
  void each(const ParticleView& view, const Found& found);

  std::vector<TriangleMesh::Triangle> triangles_;
  std::vector<std::array<int, 2>> edges_;
  std::vector<int> triangle_of_;  // of each edge
  std::vector<Reach> boxes_;      // of each triangle
  TornParts gone_;
  std::array<Line, 2> lines_;
  std::vector<int> order_, starts_, next_;  // triangles by cell; where each begins; scratch
};

}  // namespace sim
