// The surfaces of rigid bodies as elements of the contact of surfaces.
#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "contact_impulses.h"
#include "core/particles/body_geometry.h"
#include "pair_cache.h"

namespace sim {

// Bodies touch surfaces with the vertices, edges and triangles of their shapes. A ball is one
// vertex and a capsule one edge, with a radius around it. A vertex of a body is a weighted sum of
// its four particles, so that it moves straight while they do; its id lies behind those of all
// particles.
class BodySurfaces {
 public:
  BodySurfaces(const BodyGeometry& bodies, int particles);

  const BodyElements& elements() const { return elements_; }
  // The positions of all particles, then those of the vertices.
  std::vector<Vec3> places(const ParticleView& view) const;
  // The points of pairs, by these of all particles. They are valid until the next call.
  SurfacePoints points(const SurfacePoints& particles);

  // Finds how bodies move about their places at the end of the points of the last call. A body with
  // a pinned particle moves as its particles do.
  void find_motions(std::span<const double> inverse_mass);

  bool is_part(const SurfacePair& pair) const { return vertex_of(pair) >= 0; }
  const ContactMaterial& material(const SurfacePair& pair) const;
  // Gives a row the particles and weights of a pair: those of the point on the surface of the body
  // that is next to the other part after the share s of the displacements of the last call.
  void extend(const SurfacePair& pair, const Separation& apart, double s, ContactRow& row) const;
  // The ids of particles that move the parts of a pair.
  std::array<int, 4> movers(const SurfacePair& pair, std::span<const double> inverse_mass) const;

  int body_of(int id) const { return vertex(id).body; }

  // A triangle of surfaces that crosses a body with faces, and that body.
  std::optional<std::pair<TriangleMesh::Triangle, int>> crossing(
      const TriangleBvh& parts, std::span<const Vec3> places) const;

 private:
  struct Vertex {
    int body;
    std::array<double, RigidBody::kParticles> weights;
  };

  void add(int body, const RigidShape& part, const Vec3& at, const Mat3& axes);
  const Vertex& vertex(int id) const { return vertices_[slot(id - elements_.first)]; }
  // The first id of a pair that is a vertex of a body, -1: none.
  int vertex_of(const SurfacePair& pair) const;
  std::array<Vec3, 3> axes_of(const RigidBody& body, double s) const;
  template <class At>
  Vec3 sum(const Vertex& vertex, const At& at) const;  // of at(particle), by weights

  const BodyGeometry* bodies_;
  BodyElements elements_;
  std::vector<Vertex> vertices_;
  std::vector<Vec3> from_, displacement_;
  std::vector<std::uint8_t> dirty_;
  std::vector<BodyMotion> motions_;  // of all bodies; inverse mass 0: it has a pinned particle
};

}  // namespace sim
