#include "core/particles/reported_contact_work.h"

#include <algorithm>
#include <utility>

#include "core/ode/ode_system.h"

namespace sim {

double ReportedContactWork::share(double t) const {
  const double part = length_ > 0 ? (t - from_) / length_ : 1;
  return part > Events::kAtEnd ? 1 : std::max(part, 0.0);
}

// Integrates a contact power that is linear in time.
void ReportedContactWork::add_along(ContactWork& sum, double begin, double end) const {
  const double linear = end - begin, square = end * end - begin * begin;
  add(sum, steady_, linear - square);
  add(sum, along_, square);
}

void ReportedContactWork::begin(double t, double h) {
  if (!on_) return;
  add(passed_, work_sums_->take());
  add_along(passed_, share(reported_work_), 1);
  if (share(reported_work_) < 1) add(passed_, at_end_);
  steady_ = {};
  from_ = t;
  length_ = h;
}

void ReportedContactWork::steady(const ContactWork& work, double share) {
  if (on_) add(steady_, work, share);
}

void ReportedContactWork::acted() {
  if (on_) along_ = work_sums_->take();
}

void ReportedContactWork::happened() {
  if (on_) at_end_ = work_sums_->take();
}

void ReportedContactWork::show(double t) {
  on_ = true;
  reported_work_ = t;
}

ContactWork ReportedContactWork::take(double t) {
  ContactWork work = work_sums_->take();
  add(work, std::exchange(passed_, {}));
  const double before = share(reported_work_), now = share(t);
  add_along(work, before, now);
  if (before < 1 && now >= 1) add(work, at_end_);
  reported_work_ = t;
  return work;
}

void ReportedContactWork::forget() { *this = ReportedContactWork(*work_sums_); }

void ReportedContactWork::forget_ahead() {
  forget();
  on_ = true;
}

void ReportedContactWork::refused() { steady_ = along_ = at_end_ = {}; }

void ReportedContactWork::repeated() {
  work_sums_->take();
  passed_ = {};
}

}  // namespace sim
