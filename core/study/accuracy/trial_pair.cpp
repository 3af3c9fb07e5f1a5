#include "core/study/accuracy/trial_pair.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace sim::study {
namespace {

bool is_splitting(const Candidate& method) {
  return method.info.symplectic || method.info.needs_second_order;
}

}  // namespace

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

bool other_family(const Candidate& a, const Candidate& b) {
  return a.info.implicit != b.info.implicit || is_splitting(a) != is_splitting(b);
}

MethodTrials* longest_kept(const Problem& problem, std::vector<MethodTrials>& trials,
                           double allowed) {
  std::vector<std::array<double, 3>> kept;
  for (const MethodTrials& each : trials) {
    kept.push_back({0, 0, each.kept_share(allowed)});
    for (std::size_t i = 0; i + 1 < kept.size(); ++i) {
      const MethodTrials& other = trials[i];
      if (!std::isfinite(each.error()) || !std::isfinite(other.error())) continue;
      const double share = TrialPair(problem, each, other).kept_share(allowed);
      const bool confirms = other_family(other.method(), each.method());
      for (auto* of : {&kept.back(), &kept[i]})
        *of = {std::max((*of)[0], confirms ? share : 0), std::max((*of)[1], share), (*of)[2]};
    }
  }
  std::size_t best = trials.size();
  for (std::size_t i = 0; i < trials.size(); ++i) {
    if (!std::isfinite(trials[i].error())) continue;
    if (best == trials.size() || kept[i] > kept[best] ||
        (kept[i] == kept[best] && trials[i].next_cost() < trials[best].next_cost()))
      best = i;
  }
  return best < trials.size() ? &trials[best] : nullptr;
}

}  // namespace sim::study
