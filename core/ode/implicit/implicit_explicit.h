// Steps that are implicit in the stiff part of f and explicit in the rest.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/ode/outcome.h"
#include "core/ode/plan.h"
#include "core/ode/stage_solver.h"

namespace sim {

class OdeSystem;

struct ImplicitExplicitPlan {
  SplitPlan soft;      // kick, drift, kick; implicit steps take the place of the drift
  StageOptions stiff;  // of the implicit steps
  int substeps = 0;    // equal ones between the kicks; 0: as the stiffness asks for
};

// f = f_soft + f_stiff of q' = v, v' = a(t, q) - gamma v, and a step of both parts:
//   kick by a_soft, h/2;  an implicit step of q' = v, v' = a_stiff(q);  kick by a_soft, h/2
// Order 2, and stable for any stiffness of the stiff part if verlet is stable on the soft part: on
// linear springs it is verlet with the mass matrix M + h^2/4 K_stiff. Drag is in the kicks, as an
// exact flow. Zhang & Skeel (1997), Stern & Grinspun (2009), Multiscale Model. Simul. 7(4),
// 1779-1794, with the implicit midpoint rule, which makes it symplectic; a system may keep the
// energy of the stiff part instead. A system that knows its parts makes it; all memory is its own.
class ImplicitExplicitStepper {
 public:
  virtual ~ImplicitExplicitStepper() = default;

  // Partitions f for steps of at most h from the state x at t. May take memory.
  virtual void choose_partition(double t, double h, const double* x) = 0;
  // The partition as numbers, from which recall() restores it; false, without effect, if they
  // belong to another system.
  virtual std::vector<double> memory() const = 0;
  virtual bool recall(std::span<const double> memory) = 0;

  // Like Integrator::advance(), after choose_partition(). If nothing is stiff: the bits of verlet.
  virtual Advance advance(double t, double h, std::int64_t most, const double* x,
                          double* x_next) = 0;
  virtual void restart() = 0;  // as Stepper::restart()

  virtual OdeSystem* soft_part() = 0;  // its fastest mode limits the step; null: none is stiff
  // True if the soft part is a constant acceleration without drag: then implicit midpoint on all of
  // f is the same method.
  virtual bool is_all_stiff() const = 0;
  virtual Effort effort() const = 0;
  virtual std::vector<std::string> notes() const = 0;
};

}  // namespace sim
