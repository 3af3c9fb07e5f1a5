// Fields that make the steps of embedded pairs themselves.
#pragma once

#include <memory>

#include "core/fields/field.h"
#include "core/ode/embedded_stepper.h"

namespace sim {

class PairField : public Field {
 public:
  // The stages of an embedded pair made faster, with the bits of stage after stage; null: there are
  // none. The field outlives them.
  virtual std::unique_ptr<EmbeddedStepper> embedded_stepper(const EmbeddedPlan& plan) const = 0;
};

}  // namespace sim
