// The parameters that every constant law of contact has, declared in one place.
#pragma once

#include "core/plugin/params.h"

namespace sim {

inline Param friction_param() {
  return {.name = "friction",
          .default_value = 0.0,
          .doc = "Coulomb's coefficient: how much of the normal force may act against slip",
          .min = 0};
}

inline Param restitution_param() {
  return {.name = "restitution",
          .default_value = 0.0,
          .doc = "share of the normal velocity that a bounce gives back",
          .min = 0,
          .max = 1};
}

}  // namespace sim
