// The outcome of a step, and the effort of steps.
#pragma once

#include <cstdint>

namespace sim {

enum class StepStatus {
  kDone,
  kNotFinite,     // a number of x_next is not finite
  kStepTooSmall,  // the tolerance cannot be met with steps that change t
  kNotConverged,  // the equations of an implicit step were not solved
  kNotAllowed,    // no allowed state was found: OdeSystem::refusal() says why
  kStopped        // OdeSystem::stopped(): given up within the step, which may be repeated
};

// The answer of a system to the end of a step that has to stay among the allowed states.
enum class StepEnd {
  kAccepted,
  kAgain,      // there was an impact: the stages have to be repeated
  kNotAllowed  // no allowed state was found
};

// The result of several steps: the number taken, each with the bits of a single one. If the status
// is not kDone, none was taken, and the integrator is as before.
struct Advance {
  StepStatus status = StepStatus::kDone;
  int taken = 0;
};

// The effort of all steps since prepare().
struct Effort {
  std::int64_t steps = 0, rejected = 0;  // internal ones of adaptive methods
  std::int64_t evaluations = 0;          // of f
  std::int64_t newton = 0;               // Newton (or local-global) iterations
  std::int64_t factorisations = 0;
  std::int64_t linear = 0;  // iterations of an iterative linear solver
  double residual = 0;      // worst relative residual an implicit step ended with

  Effort& operator+=(const Effort& other) {
    steps += other.steps;
    rejected += other.rejected;
    evaluations += other.evaluations;
    newton += other.newton;
    factorisations += other.factorisations;
    linear += other.linear;
    residual = residual < other.residual ? other.residual : residual;
    return *this;
  }
  friend Effort operator+(Effort one, const Effort& other) { return one += other; }
};

}  // namespace sim
