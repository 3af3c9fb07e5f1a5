#include "core/study/verdict/run_deviation.h"

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

Finding finding_of(const RunDeviation& deviation, const Simulation& run) {
  using enum RunDeviation::Outcome;
  const bool flat = run.flat();
  switch (deviation.outcome) {
    case kNone:
      return {};
    case kStopped:
      if (deviation.until == HUGE_VAL) return {};
      break;
    case kShadowFailed:
      return {Trust::kSuspect, "the same run with half the step or a tenth of the tolerance fails"};
    case kCompared:
      break;
  }
  if (!std::isnan(deviation.missed_at))
    return {Trust::kSuspect, std::string(deviation.missed_motion ? "a given motion"
                                         : run.second_order()    ? "a force"
                                                                 : "the right-hand side") +
                                 " has a pulse near t = " + brief(deviation.missed_at, 4) +
                                 " s that no step has seen"};
  if (!std::isnan(deviation.others_broke_at))
    return {Trust::kChaotic, "positions are right until about t = " + brief(deviation.horizon, 2) +
                                 " s (with a finer step other springs or rods break)"};
  const bool chaotic = deviation.chaotic();
  constexpr double kFast = 1e4;
  const std::string parting_rate =
      deviation.rate < kFast
          ? "by x" + brief(deviation.rate, 2) + " a second"
          : "tenfold within " + brief(std::numbers::ln10 / std::log(deviation.rate), 2) + " s";
  const auto amount = [&](double error) { return flat ? brief(error, 2) : metres(error); };
  if (deviation.share <= deviation.allowed &&
      !(chaotic && RunDeviation::kNeighbour * deviation.growth > RunDeviation::kWrong)) {
    if (deviation.energy > kWrongEnergy)
      return {Trust::kSuspect, "energy off by " + percent(deviation.energy, 1, 2)};
    if (!std::isnan(deviation.pinched_at))
      return {Trust::kChaotic,
              "positions are right until about t = " + brief(deviation.pinched_at, 2) +
                  " s (spring " + std::to_string(deviation.pinch.a) + "-" +
                  std::to_string(deviation.pinch.b) +
                  " comes to a point there, and may leave it on either side)"};
    const std::string unit = flat ? "" : " m";
    const std::string most = brief(deviation.error, 1) + unit;
    const std::string until =
        deviation.until == HUGE_VAL ? "" : " until t = " + brief(deviation.until, 2) + " s";
    return {Trust::kTrusted,
            std::string(flat ? "numbers to " : "positions to ") +
                (std::isnan(deviation.rms) ? most
                                           : brief(deviation.rms, 2) + unit + " rms, " + most +
                                                 (flat ? " of one" : " of a particle")) +
                until + " (verified)"};
  }
  if (chaotic)
    return {Trust::kChaotic, std::string(flat ? "numbers" : "positions") +
                                 " are right until about t = " + brief(deviation.horizon, 2) +
                                 " s (neighbours part " + parting_rate + ")"};
  const std::string share = ", " + percent(deviation.share, 1, 2) + " of the size";
  if (deviation.until < HUGE_VAL)
    return {Trust::kSuspect, "off by about " + amount(deviation.at_end) +
                                 " at t = " + brief(deviation.until, 2) + " s already" + share};
  if (2 * deviation.at_end >= deviation.error)
    return {Trust::kSuspect, "off by about " + amount(deviation.at_end) + " by the end" + share};
  return {Trust::kSuspect, "off by up to " + amount(deviation.error) + " on the way" + share};
}

}  // namespace sim::study
