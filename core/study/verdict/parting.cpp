#include "core/study/verdict/parting.h"

#include <numbers>

#include "core/base/text.h"
#include "core/study/verdict/criterion.h"

namespace sim::study {
namespace {

constexpr double kWrongEnergy = 0.01;  // of the energy in play

std::string metres(double length) {
  if (length < 0.1 && length >= 1e-3) return brief(100 * length, 2) + " cm";
  return brief(length, 2) + " m";
}

}  // namespace

Finding finding_of(const Parting& parting, const Simulation& run) {
  using enum Parting::Outcome;
  const bool flat = run.flat();
  switch (parting.outcome) {
    case kNone:
      return {};
    case kStopped:
      return {Trust::kTrusted, "not verified: stopped"};
    case kShadowFailed:
      return {Trust::kSuspect, "the same run with half the step or a tenth of the tolerance fails"};
    case kCompared:
      break;
  }
  if (!std::isnan(parting.missed_at))
    return {Trust::kSuspect, std::string(run.second_order() ? "a force" : "the right-hand side") +
                                 " has a pulse near t = " + brief(parting.missed_at, 4) +
                                 " s that no step has seen"};
  if (!std::isnan(parting.others_broke_at))
    return {Trust::kChaotic, "positions are right until about t = " + brief(parting.horizon, 2) +
                                 " s (with a finer step other springs break)"};
  const bool chaotic = parting.chaotic();
  constexpr double kFast = 1e4;
  const std::string parting_rate =
      parting.rate < kFast
          ? "by x" + brief(parting.rate, 2) + " a second"
          : "tenfold within " + brief(std::numbers::ln10 / std::log(parting.rate), 2) + " s";
  const auto amount = [&](double error) { return flat ? brief(error, 2) : metres(error); };
  if (parting.share <= Parting::kWrong &&
      !(chaotic && Parting::kNeighbour * parting.growth > Parting::kWrong)) {
    if (parting.energy > kWrongEnergy)
      return {Trust::kSuspect, "energy off by " + percent(parting.energy, 1, 2)};
    if (!std::isnan(parting.pinched_at))
      return {Trust::kChaotic,
              "positions are right until about t = " + brief(parting.pinched_at, 2) +
                  " s (spring " + std::to_string(parting.pinch.a) + "-" +
                  std::to_string(parting.pinch.b) +
                  " comes to a point there, and may leave it on either side)"};
    return {Trust::kTrusted, (flat ? "numbers to " + brief(parting.error, 1)
                                   : "positions to " + brief(parting.error, 1) + " m") +
                                 " (verified)"};
  }
  if (chaotic)
    return {Trust::kChaotic, std::string(flat ? "numbers" : "positions") +
                                 " are right until about t = " + brief(parting.horizon, 2) +
                                 " s (neighbours part " + parting_rate + ")"};
  const std::string share = ", " + percent(parting.share, 1, 2) + " of the size";
  if (2 * parting.at_end >= parting.error)
    return {Trust::kSuspect, "off by about " + amount(parting.at_end) + " by the end" + share};
  return {Trust::kSuspect, "off by up to " + amount(parting.error) + " on the way" + share};
}

}  // namespace sim::study
