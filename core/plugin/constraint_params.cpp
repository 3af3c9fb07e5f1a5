#include "core/plugin/constraint_params.h"

namespace sim {

ParamList constraint_params(ParamList own) {
  own.push_back({.name = "feedback",
                 .default_value = 0.0,
                 .unit = "1/s",
                 .doc = "0: states are put back among the allowed ones after each step; else "
                        "Baumgarte's rate at which what is off decays, of all constraints the "
                        "largest, for methods that evaluate forces alone",
                 .min = 0});
  return own;
}

}  // namespace sim
