#include "core/plugin/periodic.h"

#include "core/base/error.h"

namespace sim {
namespace {

constexpr double kTurn = 6.28318530717958647692;

}  // namespace

Period::Period(const Params& params, const std::string& owner)
    : period_(params.number("period")),
      phase_(params.number("phase") / kTurn),
      rate_(kTurn / period_) {
  if (period_ == 0)
    throw Error(ErrorKind::kScene, {owner, "", "its period is 0",
                                    "give a period in s; one below 0 goes the other way"});
}

ParamList periodic_params(ParamList own) {
  own.push_back({.name = "period", .unit = "s", .doc = "of one turn", .required = true});
  own.push_back(
      {.name = "phase", .default_value = 0.0, .unit = "rad", .doc = "the angle at t = 0"});
  return own;
}

Param axis_param() {
  return {.name = "axis",
          .type = ParamType::kVector,
          .default_value = Vec3(0, 1, 0),
          .doc = "of any length but 0"};
}

Vec3 axis_of(const Params& params, const std::string& owner) {
  const Vec3 axis = params.vector("axis");
  const double length = axis.stableNorm();
  if (!(length > 0))
    throw Error(ErrorKind::kScene,
                {owner, "", "its axis has no length", "give a direction, {0, 1, 0}"});
  return axis / length;
}

}  // namespace sim
