// The parameters that periodic motions have in common.
#pragma once

#include <string>
#include <vector>

#include "core/plugin/params.h"

namespace sim {

// The angle 2 pi t / period + phase, in turns.
class Period {
 public:
  Period(const Params& params, const std::string& owner);  // of periodic_params()
  double turns(double t) const { return t / period_ + phase_; }
  double rate() const { return rate_; }  // rad/s

 private:
  double period_, phase_, rate_;
};

// The parameters `period` and `phase` behind those of a motion's own.
ParamList periodic_params(ParamList own);

Param axis_param();
Vec3 axis_of(const Params& params, const std::string& owner);  // of length 1

}  // namespace sim
