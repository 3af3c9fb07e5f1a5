#include "core/plugin/explicit_plugin.h"

namespace sim {

Param precision_param() {
  return {.name = "precision",
          .type = ParamType::kText,
          .default_value = std::string("double"),
          .doc =
              "of the numbers in a step: single takes 24 bits of 53 and about half the time; for "
              "springs, gravity and drag",
          .choices = {"double", "single"}};
}

Precision precision_of(const Params& params) {
  return params.text("precision") == "single" ? Precision::kSingle : Precision::kDouble;
}

}  // namespace sim
