#include "core/study/accuracy/trial_pair.h"

#include <algorithm>

namespace sim::study {

bool TrialPair::agree(double negligible) const {
  for (std::size_t k = 0; k < off_.rms.size(); ++k) {
    const double errors = a_->error_until(share(k)) + b_->error_until(share(k));
    if (off_.rms[k] > std::max(kFamiliesAgree * errors, negligible)) return false;
  }
  return true;
}

double TrialPair::beyond(const MethodTrials& known) const {
  double most = 0;
  for (std::size_t k = 0; k < off_.rms.size(); ++k)
    most = std::max(most, off_.rms[k] - known.error_until(share(k)));
  return most;
}

double TrialPair::kept_share(double allowed) const {
  return std::min({a_->kept_share(allowed), b_->kept_share(allowed),
                   study::kept_share(off_.rms, 2 * kFamiliesAgree * allowed)});
}

}  // namespace sim::study
