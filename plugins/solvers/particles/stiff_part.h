// The partition of forces into stiff and soft for a step size, and each part as a system.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/base/thread_pool.h"
#include "core/ode/ode_system.h"
#include "core/particles/particles.h"

namespace sim {

// A spring of stiffness k between a and b has omega^2 = k (1/m_a + 1/m_b) by itself; it is stiff if
// omega reaches a cut. Other forces (dashpots, bending, cells) are stiff as a whole.
struct Partition {
  double step = 0;                   // s, for which it was found
  double cut = HUGE_VAL;             // rad/s
  std::vector<std::uint8_t> others;  // of each force that is on; 1: it accumulates stiffly

  bool operator==(const Partition&) const = default;
};

// The numbers of stiff and soft springs and forces, for reports.
struct PartitionCount {
  long springs = 0, stiff_springs = 0;
  int particles = 0;                           // at the ends of stiff springs
  double fastest_soft = 0, fastest_stiff = 0;  // rad/s: of all that is soft, of one stiff spring

  bool none() const { return stiff_springs == 0 && stiff_forces == 0; }
  long stiff_forces = 0;  // that accumulate
};

// The soft forces on all particles, as a system whose fastest mode limits the step.
class SoftSystem final : public OdeSystem, public Particles {
 public:
  using Particles::Particles;

  std::size_t size() const noexcept override { return layout().size() + internal_size(); }
  void eval(double t, const Stage& stage, double* y, double* dydt) override;
  void combine(const Stage& stage, double* out) override;
  std::unique_ptr<Jacobian> jacobian() override;

 private:
  CombineRange combine_range_ = combine_range();
};

class StiffPart {
 public:
  // The scene's own choice for a force, to be implicit or explicit.
  using Said = std::function<std::optional<bool>(const Force&)>;

  // The system outlives it.
  StiffPart(Particles& system, Said said) : system_(&system), said_(std::move(said)) {}

  // Explicit kicks of size h are stable on the fastest mode of the soft part, which has as many
  // springs as possible. If most would be stiff, all are, unless those are chains and trees
  // far above the rest. The scene's own choices are kept.
  Partition choose(double t, double h, const double* x);

  PartitionCount count(const Partition& partition) const;

  // All particles, with the soft forces, the affine ones and those with internal variables. The
  // forces belong to the system, which lends them; springs of which some are stiff are copied.
  std::unique_ptr<SoftSystem> soft_system(const Partition& partition, const double* x) const;

  // The stiff forces alone: on the particles of `ids`, ascending, renumbered; or on all, if `ids`
  // is empty.
  std::unique_ptr<Particles> stiff_system(const Partition& partition, std::span<const int> ids,
                                          const double* x, ThreadPool& pool) const;

  // The ends of stiff springs, ascending; empty if stiff forces accumulate, and may read any
  // particle.
  std::vector<int> stiff_particles(const Partition& partition) const;

 private:
  // Calls visit(a, b, k, rest) for the stiff springs, or for the soft ones, of an active force.
  template <class Visit>
  void for_springs(const Partition& partition, std::size_t force, bool stiff,
                   const Visit& visit) const;
  std::optional<bool> said(Force& force) const;
  double omega(int a, int b, double k) const;  // rad/s, of a spring by itself
  bool accumulates_stiffly(const Partition& partition, std::size_t force) const;
  std::vector<double> rates_of_others(double t, const double* x) const;

  Particles* system_;
  Said said_;
};

}  // namespace sim
