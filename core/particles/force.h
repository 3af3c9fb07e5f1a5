// Forces on particles: they see a view of all particles and add to the force on a few.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/particles/force_sweep.h"
#include "core/particles/jacobian_sink.h"
#include "core/particles/link.h"
#include "core/particles/view.h"

namespace sim {

// f = mass * acceleration - damping * v, the same for every free particle. The system folds all of
// these into its last pass over the particles, where they cost nothing.
struct AffineForce {
  Vec3 acceleration = Vec3::Zero();  // m/s^2
  double damping = 0;                // kg/s
};

class Breakable;
class Particles;
class Springs;
struct SceneNames;  // core/particles/scene_names.h
class StepCorrection;
class ThreadPool;

// A force is a pure function of (t, X): its changing internal variables are part of X.
class Force {
 public:
  virtual ~Force() = default;

  // Called once with the initial state; may allocate and may throw Error.
  virtual void bind(const ParticleView& /*initial*/) {}

  // The affine part of the force. No other part is accumulated, unless the force has internal
  // variables or says so.
  virtual std::optional<AffineForce> affine() const { return {}; }

  // Springs are folded too: all of a scene are evaluated in one sweep. A force of springs that also
  // damps them is accumulated for that part alone.
  virtual const Springs* springs() const { return nullptr; }
  virtual bool accumulates() const { return internal_size() > 0 || (!affine() && !springs()); }

  // Called for any other force before accumulate(), potential() and jacobian() of the same view:
  // builds the shared data of its tiles (neighbour lists, densities). Their results must follow
  // from the view alone, bit for bit. May take memory only where it had too little.
  virtual void prepare(const ParticleView& /*view*/, ThreadPool& /*team*/) {}

  // Then: adds the force on each particle of the tile and writes no other entry. Runs on several
  // threads.
  virtual void accumulate(const ParticleView& /*view*/, Tile /*tile*/, ForceSink /*sink*/) const {}

  // The same without prepare(), piece by piece: explicit methods are faster. Null: as above only.
  virtual std::unique_ptr<ForceSweep> sweep() const { return nullptr; }

  // False when accumulate() reads no velocity: splitting methods (verlet) need to know.
  virtual bool depends_on_velocity() const { return true; }

  // Internal variables of the force: how many numbers of X are its own (`internal` of every view),
  // their values at t = 0 and, after prepare(), their rates of change.
  virtual int internal_size() const { return 0; }
  virtual void start(std::span<double> /*memory*/) const {}
  virtual void derive(const ParticleView& /*view*/, std::span<double> /*rate*/) const {}
  // False when derive() follows from t and the internal variables alone: splitting methods need
  // that, implicit ones are faster. It is then called without prepare(), and its view has no
  // particles.
  virtual bool internal_depends_on_particles() const { return true; }

  // Implicit methods need the derivatives of accumulate(): jacobian() gives them, as blocks in any
  // order; blocks of one pair (i, j) add up. Without it, differences of accumulate() are taken.
  virtual bool has_jacobian() const { return false; }
  virtual void jacobian(const ParticleView& /*view*/, JacobianSink& /*sink*/) const {}
  // Appends the pairs of particles whose blocks jacobian() may add, in any order, at any state,
  // torn or not: a sparse factorisation is planned for them. False if they change with the state,
  // as the pairs within a cutoff do. Called after bind().
  virtual bool couplings(std::vector<std::array<int, 2>>& /*pairs*/) const { return false; }

  // Potential energy in J. Each contribution is counted in exactly one tile.
  virtual double potential(const ParticleView& /*view*/, Tile /*tile*/) const { return 0; }

  // True if F = -dU/dx holds for the potential and the force does no other work.
  virtual bool conservative() const { return false; }

  // True if it is conservative except for a dissipative part, which dissipative_part() adds alone,
  // as accumulate() adds the whole.
  virtual bool has_dissipative_part() const { return false; }
  virtual void dissipative_part(const ParticleView& /*view*/, Tile /*tile*/,
                                ForceSink /*sink*/) const {}

  // The correction at the end of each step, besides the forces: core/particles/ step_correction.h.
  // Called once, after bind(); the particles outlive it. Null: none.
  virtual std::unique_ptr<StepCorrection> correction(Particles& particles);

  // The ties that may break; null: none does. Known before bind().
  virtual Breakable* breakable() { return nullptr; }
  // Called before bind() if some tie of the scene may break, so that tear() will be called.
  virtual void expect_tears() {}
  // Removes the coherence between these pairs of particles, ascending, whose ties broke: a force on
  // a surface leaves out the faces with such an edge. Replaces earlier pairs.
  virtual void tear(std::span<const std::array<int, 2>> /*torn*/) {}

  // Notes for the user on this force in this scene, after bind(), each to follow its name: "does
  // not see body 0: ...".
  virtual std::vector<std::string> notes(const SceneNames& /*names*/) const { return {}; }

  // Appends the links of particle i; how many each family has, in the order of definition.
  virtual void links(int /*i*/, std::vector<Link>& /*out*/) const {}
  virtual std::vector<std::pair<std::string, long>> families() const { return {}; }
};

// The range of the internal variables of a force among those of all forces in a state.
struct InternalVariables {
  Force* force;
  std::size_t begin, size;
};

}  // namespace sim
