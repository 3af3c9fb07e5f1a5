#include "core/particles/constraints/held_contact.h"

#include <algorithm>
#include <cmath>

#include "core/base/finite.h"

namespace sim {
namespace {

constexpr int kMostCuts = 64;     // of a step
constexpr int kMostHalvings = 3;  // of what has no end
constexpr double kFails = -1;
constexpr double kNever = HeldPress::kNever, kTogether = HeldPress::kTogether;

}  // namespace

HeldContact::HeldContact(Particles& particles, Holding& holding, bool first_order)
    : particles_(&particles),
      holding_(&holding),
      press_(particles, holding, first_order),
      start_(holding.memory_begin() + holding.memory_size()) {}

// The state at the end of a piece, or false where there is none.
bool HeldContact::advance(Stepper& stepper, const Piece& piece, bool again) {
  if (again) stepper.restart();
  if (piece.r > 0) return stepper.step(piece.t, piece.r, 1, piece.from, piece.to);
  std::copy_n(piece.from, start_.size(), piece.to);
  return true;
}

// How much of a piece was made, as a share of it; < 0: it has no end.
double HeldContact::make(Stepper& stepper, const Piece& piece, bool again, bool may_cut) {
  const Contacts& contacts = particles_->contacts();
  if (!advance(stepper, piece, again)) return kFails;
  press_.find(piece.ends());
  const auto& meetings = press_.meetings();
  if (meetings.empty()) return 1;
  touched_ = true;
  // What lies on surfaces is pressed on first, for it changes where others go.
  if (std::ranges::any_of(meetings, &Meeting::known)) {
    if (!press_.press(piece, -1, false)) return kFails;
    press_.find(piece.ends());
  }
  const bool hits = std::ranges::any_of(meetings, [](const Meeting& m) { return !m.known; });
  const double s = may_cut ? press_.next_cut() : kNever;
  if (s == kNever && hits) {
    if (std::ranges::any_of(meetings, &Meeting::cuts)) contacts.ledger().count_uncut();
    if (!advance(stepper, piece, true) || !press_.press(piece, 1, false)) return kFails;
  } else if (s < 1) {
    Piece before = piece;
    before.r = s * piece.r;
    if (!advance(stepper, before, true) || !press_.press(before, s + kTogether, true))
      return kFails;
  }
  if (!all_finite({piece.to, start_.size()})) return kFails;
  press_.enter();
  return s;
}

bool HeldContact::step(Stepper& stepper, double t, double h, const double* x, double* x_next) {
  const Contacts& contacts = particles_->contacts();
  contacts.ledger().begin_step();
  if (contacts.sampled()) contacts.look(t, t + h);
  Piece piece{t, h, x, x_next};
  touched_ = false;
  bool again = press_.put_out(t, x, start_.data());
  if (again) piece.from = start_.data();
  int smaller = 0;
  for (int cuts = 0;; ++cuts) {
    holding_->refuse({});
    piece.last = smaller == kMostHalvings;
    const double made = make(stepper, piece, again, cuts < kMostCuts);
    again = again || touched_;
    if (made < 0) {
      if (piece.last || !touched_) {
        // Where numbers are not finite they say it themselves.
        const bool finite = all_finite({x_next, start_.size()});
        if (finite && holding_->refusal().empty())
          holding_->refuse("constraints and colliders: this step has no end");
        if (finite || !holding_->refusal().empty()) std::copy_n(x, start_.size(), x_next);
        return false;
      }
      piece.r *= 0.5;
      ++smaller;
      continue;
    }
    const double now = piece.t + std::min(made, 1.0) * piece.r;
    if (!(now < t + h * (1 - kTogether * kTogether))) break;
    std::copy_n(x_next, start_.size(), start_.data());
    piece = {now, t + h - now, start_.data(), x_next};
  }
  if (again) stepper.restart();
  return all_finite({x_next, start_.size()});
}

}  // namespace sim
