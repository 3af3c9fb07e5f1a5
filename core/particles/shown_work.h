// Work of contact as far as it is shown.
#pragma once

#include "core/particles/contact_ledger.h"

namespace sim {

inline void add(ContactWork& sum, const ContactWork& work, double share = 1) {
  sum.lost += share * work.lost;
  sum.given += share * work.given;
}

// A method with steps of its own may be beyond the state that it shows. What acts all along such a
// step counts by its share, what happens at its end when that is shown. Nothing is kept before the
// first show().
class ShownWork {
 public:
  explicit ShownWork(ContactLedger& ledger) : ledger_(&ledger) {}

  void show(double t);         // the time of the present state
  ContactWork take(double t);  // J since then, and shows t
  void forget();
  void forget_ahead();  // another course comes
  void repeated();      // the step that just ended was taken before

  // A step from t on ends: what was entered into the ledger until acted() acted along it, of which
  // `steady` is what there were if the power stayed that of the start; then what happened at the
  // end.
  void begin(double t, double h);
  void steady(const ContactWork& work, double share);
  void acted();
  void happened();

 private:
  double share(double t) const;
  void add_along(ContactWork& sum, double begin, double end) const;  // between two shares

  ContactLedger* ledger_;
  bool on_ = false;
  double from_ = 0, length_ = 0, shown_ = 0;  // s
  ContactWork passed_ = {}, along_ = {}, at_end_ = {}, steady_ = {};
};

}  // namespace sim
