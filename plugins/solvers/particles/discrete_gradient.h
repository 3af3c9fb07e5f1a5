// Steps of springs alone that keep their energy to rounding.
#pragma once

#include <functional>
#include <vector>

#include "core/ode/ode_system.h"
#include "core/particles/particles.h"
#include "core/particles/springs/springs.h"
#include "pivoted_block_lu.h"

namespace sim {

// The implicit midpoint rule with the force of a spring of length l and vector d replaced by
//   f = -(U(l1) - U(l0)) / (l1^2 - l0^2) (d0 + d1)
// of the start and the end of the step, which for U = k/2 (l - rest)^2 is
//   f = -k (1 - 2 rest / (l0 + l1)) (d0 + d1) / 2
// so that f.(d1 - d0) = U(l0) - U(l1). A step keeps energy, momentum and angular momentum; it is
// symmetric and of order 2, and the midpoint rule itself for springs without a rest length. It is
// not symplectic. LaBudde & Greenspan (1976), Numer. Math. 25, 323-346; Gonzalez (1996), J.
// Nonlinear Sci. 6, 449-467.
//
// The midpoint rule keeps lengths in the middle of its steps. At their ends stiff springs that turn
// ring, and from h omega of about 5 on that feeds on the motion: a chain of springs that folds
// gains any amount of energy, however exactly the equations are solved.
//
// A spring whose omega the step does not resolve rings from step to step as (-1)^n, which kicks of
// other forces may feed. Its force then has a part chi (l1 - l0) more in its stretch, which takes
// k chi (l1 - l0)^2 from the energy of the ringing (Armero & Romero (2001), Comput. Methods Appl.
// Mech. Eng. 190, 2603-2649). chi is 0 for h omega < 10, where the order counts, and 2 / (h omega)
// at most, which is critical: the ringing falls by 4 / (h omega) of itself in a step. With more the
// stretch dies at once and leaves the velocity along the spring, which changes its sign in each
// step and loses 4 / ((h omega)^2 chi) of itself.
class DiscreteGradientSolver {
 public:
  // `system` has springs alone, and no contacts. stopped(): polled, ends a step with kStopped.
  // tolerance: of the residual, relative to that at the start; 0: as small as energy asks for.
  DiscreteGradientSolver(const Particles& system, double tolerance, std::function<bool()> stopped);

  // Takes the state x = (q, v), in the layout of the system, h further. Where Newton's method does
  // not converge two steps of h/2 are taken. kNotConverged where that does not help.
  StepStatus step(double h, double* x);
  Effort effort() const { return effort_; }

 private:
  struct Spring {
    int a = 0, b = 0;                   // places in the lists below
    double k = 0, rest = 0, omega = 0;  // omega: rad/s, of the spring by itself
    SpringSense sense = SpringSense::kBoth;
    int pair = -1;            // of blocks of the matrix; -1: one of the ends is fixed
    Vec3 start = {};          // d0
    double start_length = 0;  // l0
    double damping = 0;       // chi
    double alpha = 0;         // f = -k alpha (d0 + d1) / 2
    Vec3 slope = {};          // of alpha against the difference of the velocities
    double predicted = 0;     // alpha, to first order from the last iterate
  };

  StepStatus halve(double h, int depth);
  StepStatus solve(double h);
  void begin(double h);
  double evaluate(double h);            // g := .. at v; |g|
  void assemble(double h, bool first);  // the matrix of a Newton step
  double rounding(double h) const;
  double speed() const;

  double tolerance_;
  std::function<bool()> stopped_;
  Layout layout_;
  std::vector<int> id_;  // of each place, the free ones in the order of elimination first
  std::size_t free_ = 0;
  std::vector<double> mass_;
  std::vector<Spring> springs_;
  std::vector<double> stiffness_;  // of each free place, the sum of its springs' k
  std::vector<Vec3> q_, v_, middle_, trial_, g_, d_;  // middle_: the unknown velocities
  PivotedBlockLu matrix_;
  Effort effort_;
};

}  // namespace sim
