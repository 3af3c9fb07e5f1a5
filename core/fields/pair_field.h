// Fields that make steps themselves: of embedded pairs, and of many runs side by side.
#pragma once

#include <memory>
#include <span>

#include "core/fields/field.h"

namespace sim {

class PairField : public Field {
 public:
  // A faster stepper for the stages of an embedded pair, with the bits of stage after stage; null:
  // none. The field outlives it.
  virtual std::unique_ptr<EmbeddedStepper> embedded_stepper(const EmbeddedPlan& plan) const = 0;

  // A run of a field, which outlives the steps, from its state at the start.
  struct Run {
    const PairField* field;
    std::span<const double> start;
    double h;  // of its steps
  };
  // From now on equal explicit steps of these runs, of which this field is the first, are made side
  // by side, with the bits of each by itself; fields that differ in more than numbers are left out.
  // False where that leaves none beside this one.
  virtual bool step_side_by_side(std::span<const Run> runs) const = 0;
  virtual bool may_step_side_by_side() const = 0;  // with others like it
};

}  // namespace sim
