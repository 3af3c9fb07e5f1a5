// The visible part of a system, as plain data: a Model once, and a Frame for each moment. Pages,
// files and pictures are made of these and know no particle system.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/geometry/render_shape.h"
#include "core/math/vec3.h"
#include "core/particles/springs/spring_sense.h"

namespace sim {

class Simulation;
struct SystemSpec;

// Springs of one name, or rods of one constraint.
struct ModelFamily {
  std::string name;
  std::vector<std::array<int, 2>> ends = {};      // ids, the lower first
  std::vector<double> rest = {}, stiffness = {};  // m, N/m; rods have a stiffness of 0
  std::vector<SpringSense> sense = {};            // of springs
  bool rods = false;
};

// An end of a tie: a particle, or a point of a rigid body as a weighted sum of its four particles.
struct ModelPoint {
  int count = 1;
  std::array<int, 4> ids{};
  std::array<double, 4> weights{1, 0, 0, 0};
};
using ModelTie = std::array<ModelPoint, 2>;

struct Model {
  std::string name, method;  // of the system and of its integrator
  double h = 0;              // s
  int particles = 0;         // a flat state is one, at its first components
  bool second_order = false, flat = false;
  // For a lattice of cells, whose grid it is: the names of the numbers in each of them. Cells of
  // one direction are curves, a family for each name, whose points are particles; of two and three
  // a picture, with a particle a cell that is coloured by one of the numbers.
  std::vector<std::string> names;
  std::vector<double> mass;                   // kg, of each particle; empty in first order
  std::vector<int> pinned;                    // ids, ascending
  std::vector<int> in_bodies;                 // the particles of rigid bodies
  std::vector<std::array<int, 3>> triangles;  // of surfaces, or of the grid
  std::array<int, 3> grid{0, 0, 0};           // particles in each direction; 0: there is none
  std::vector<ModelFamily> families;
  std::vector<ModelTie> ties;       // of formulas, and those to points of bodies
  Vec3 up{0, 1, 0};                 // against gravity, of length 1
  Vec3 gravity{0, 0, 0};            // m/s^2, on all particles
  double drag = 0;                  // kg/s, on all particles
  std::vector<std::string> others;  // that act besides these and springs: "collider 'sphere'"

  bool lattice() const { return !names.empty(); }
  bool curves() const { return lattice() && triangles.empty(); }

  // For each particle: true if a solid or a curve is drawn for it.
  std::vector<bool> in_triangles() const;
};

struct Frame {
  std::int64_t step = 0;
  double t = 0;                    // s
  std::vector<double> x, v;        // m, m/s: x0 y0 z0 x1 ...; v only in second order
  std::vector<double> components;  // all numbers of a flat state
  std::vector<RenderShape> solids;
  // J; not a number where unknown.
  double kinetic = std::nan(""), potential = std::nan(""), work = std::nan(""),
         drift = std::nan("");
  std::vector<double> values;  // one a particle, that somebody else measured: errors, a mode
  // The paths of the points that leave trails, in the order of trails_of(), from the moment before
  // to this one, m; empty if nobody has followed them.
  std::vector<std::vector<Vec3>> paths = {};
  std::string note;                           // words on its picture, below the caption
  std::vector<std::array<int, 2>> torn = {};  // pairs that ties joined until they broke: ids, the
                                              // lower first, ascending

  Vec3 at(int i) const {
    const double* p = x.data() + 3 * static_cast<std::size_t>(i);
    return {p[0], p[1], p[2]};
  }
  Vec3 at(const ModelPoint& point) const {
    if (point.count == 1) return at(point.ids[0]);
    Vec3 sum = Vec3::Zero();
    for (std::size_t k = 0; k < 4; ++k) sum += point.weights[k] * at(point.ids[k]);
    return sum;
  }
};

// One frame a system, in the order of the models.
using Moment = std::vector<Frame>;

Model make_model(const SystemSpec& spec, Simulation& system);

// Without energies and values.
Frame take_frame(const Simulation& system);

// True if the ties that joined two particles are broken; a face with such an edge is gone.
bool torn(const Frame& frame, int a, int b);
bool torn(const Frame& frame, const std::array<int, 3>& triangle);

// (length - rest) / rest of a spring; not a number if rest is 0 or the spring broke.
double strain(const Model& model, const Frame& frame, int family, std::size_t spring);

}  // namespace sim
