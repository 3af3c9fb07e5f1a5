#include "rigid_correction.h"

#include "core/base/text.h"

namespace sim {

StepCorrection::Account RigidCorrection::account() const {
  const RigidContact::Counts& counts = contact_.counts();
  const bool surfaces = contact_.body_collision().leaves_some_out();
  Account account{
      .words = surfaces ? "bodies touched nothing rigid" : "bodies touched nothing",
      .acted = counts.most > 0,
      .figures = {
          {"points", counts.most}, {"unsettled", counts.unconverged}, {"halved", counts.halved}}};
  if (!account.acted) return account;
  account.words = "bodies touched at up to " + std::to_string(counts.most) + " points";
  if (counts.halved > 0)
    account.words += ", " + std::to_string(counts.halved) +
                     (counts.halved == 1 ? " step" : " steps") + " halved";
  // Bounds on the residual of a solver that did not converge: to be reported, and to be distrusted.
  constexpr double kSaid = 1e-6, kDoubted = 1e-3;
  if (counts.unconverged > kSaid * counts.fastest)
    account.words += ", impulses between them to " + brief(counts.unconverged, 2) + " m/s";
  account.kept = !(counts.unconverged > kDoubted * counts.fastest);
  return account;
}

}  // namespace sim
