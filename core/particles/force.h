// What acts on particles: forces see a view of all particles and add to the force on a few.
#pragma once

#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/vec3.h"

namespace sim {

using Mat3 = Eigen::Matrix3d;

// Structure of arrays; n entries each, in SI units; padding lanes around them may be read.
// vx, vy, vz are null in a scene without velocities.
struct ParticleView {
  int n = 0;
  double t = 0;
  const double *x = nullptr, *y = nullptr, *z = nullptr;
  const double *vx = nullptr, *vy = nullptr, *vz = nullptr;
  const double* mass = nullptr;  // kg; infinity for a pinned particle

  bool free(int i) const { return mass[i] < HUGE_VAL; }
  double free_mass(int i) const { return free(i) ? mass[i] : 0; }
  Vec3 position(int i) const { return {x[i], y[i], z[i]}; }
  Vec3 velocity(int i) const { return {vx[i], vy[i], vz[i]}; }
};

// The particles [begin, end) whose force is being gathered.
struct Tile {
  int begin = 0, end = 0;
};

// Where forces are added, in N, indexed by particle id.
struct ForceSink {
  double *x, *y, *z;

  void add(int i, const Vec3& force) const {
    x[i] += force.x();
    y[i] += force.y();
    z[i] += force.z();
  }
};

// Where a force puts its derivatives: blocks of 3 x 3.
class BlockSink {
 public:
  virtual void position(int i, int j, const Mat3& block) = 0;  // += df_i / dx_j, N/m
  virtual void velocity(int i, int j, const Mat3& block) = 0;  // += df_i / dv_j, N s/m

 protected:
  ~BlockSink() = default;
};

// f = mass * acceleration - damping * v, the same for every free particle. The system folds all of
// these into its last pass over the particles, where they cost nothing.
struct AffineForce {
  Vec3 acceleration = Vec3::Zero();  // m/s^2
  double damping = 0;                // kg/s
};

class Springs;

// One spring-like tie of a particle to another, for adjacency listings.
struct Link {
  std::string family;
  int to = 0;
  double stiffness = 0, rest = 0;  // N/m, m
};

// A force is a pure function of (t, X): memory that changes belongs in X.
class Force {
 public:
  virtual ~Force() = default;

  // Called once with the initial state; may allocate and may throw Error.
  virtual void bind(const ParticleView& /*initial*/) {}

  // An affine force is described here and never accumulated.
  virtual std::optional<AffineForce> affine() const { return {}; }

  // Springs are folded too: all of a scene are evaluated in one sweep, and never accumulated.
  virtual const Springs* springs() const { return nullptr; }

  // Any other force: adds the force on each particle of the tile and writes no other entry. Runs on
  // several threads.
  virtual void accumulate(const ParticleView& /*view*/, Tile /*tile*/, ForceSink /*sink*/) const {}

  // False when accumulate() reads no velocity: splitting methods (verlet) need to know.
  virtual bool depends_on_velocity() const { return true; }

  // Implicit methods need the derivatives of accumulate(): jacobian() gives them, with the same
  // pairs (i, j) in the same order at every state. Without, differences of accumulate() are taken.
  virtual bool has_jacobian() const { return false; }
  virtual void jacobian(const ParticleView& /*view*/, BlockSink& /*sink*/) const {}

  // Potential energy in J. Each contribution is counted in exactly one tile.
  virtual double potential(const ParticleView& /*view*/, Tile /*tile*/) const { return 0; }

  // Appends the links of particle i.
  virtual void links(int /*i*/, std::vector<Link>& /*out*/) const {}

  // Number of links of each family, for summaries; families in the order of definition.
  virtual std::vector<std::pair<std::string, long>> families() const { return {}; }
};

}  // namespace sim
