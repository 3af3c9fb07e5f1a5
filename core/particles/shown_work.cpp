#include "core/particles/shown_work.h"

#include <algorithm>
#include <utility>

namespace sim {

double ShownWork::share(double t) const {
  const double part = length_ > 0 ? (t - from_) / length_ : 1;
  return part > 1 - 1e-9 ? 1 : std::max(part, 0.0);
}

// Of a power that changes linearly.
void ShownWork::add_along(ContactWork& sum, double begin, double end) const {
  const double linear = end - begin, square = end * end - begin * begin;
  add(sum, steady_, linear - square);
  add(sum, along_, square);
}

void ShownWork::begin(double t, double h) {
  if (!on_) return;
  add(passed_, ledger_->take());
  add_along(passed_, share(shown_), 1);
  if (share(shown_) < 1) add(passed_, at_end_);
  steady_ = {};
  from_ = t;
  length_ = h;
}

void ShownWork::steady(const ContactWork& work, double share) {
  if (on_) add(steady_, work, share);
}

void ShownWork::acted() {
  if (on_) along_ = ledger_->take();
}

void ShownWork::happened() {
  if (on_) at_end_ = ledger_->take();
}

void ShownWork::show(double t) {
  on_ = true;
  shown_ = t;
}

ContactWork ShownWork::take(double t) {
  ContactWork work = ledger_->take();
  add(work, std::exchange(passed_, {}));
  const double before = share(shown_), now = share(t);
  add_along(work, before, now);
  if (before < 1 && now >= 1) add(work, at_end_);
  shown_ = t;
  return work;
}

void ShownWork::forget() { *this = ShownWork(*ledger_); }

void ShownWork::forget_ahead() {
  forget();
  on_ = true;
}

void ShownWork::repeated() {
  ledger_->take();
  passed_ = {};
}

}  // namespace sim
