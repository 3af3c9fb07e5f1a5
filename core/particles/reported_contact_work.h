// The work of contact up to the reported time.
#pragma once

#include "core/particles/contact_work_sums.h"

namespace sim {

inline void add(ContactWork& sum, const ContactWork& work, double share = 1) {
  sum.lost += share * work.lost;
  sum.given += share * work.given;
}

// A method with internal steps may be ahead of the state that it reports. Work along such a step
// counts in proportion to the reported part, work at its end once the end is reported. Nothing is
// stored before the first show().
class ReportedContactWork {
 public:
  explicit ReportedContactWork(ContactWorkSums& work_sums) : work_sums_(&work_sums) {}

  void show(double t);         // the time of the present state
  ContactWork take(double t);  // J since then, and shows t
  void forget();
  void forget_ahead();  // another course comes
  void refused();       // the step that just ended is not taken
  void repeated();      // the step that just ended was taken before

  // Ends a step from t on: work entered until acted() acted along the step, and `steady` is its
  // part under the power at the start; work entered later happened at the end.
  void begin(double t, double h);
  void steady(const ContactWork& work, double share);
  void acted();
  void happened();

 private:
  double share(double t) const;
  void add_along(ContactWork& sum, double begin, double end) const;  // between two shares

  ContactWorkSums* work_sums_;
  bool on_ = false;
  double from_ = 0, length_ = 0, reported_work_ = 0;  // s
  ContactWork passed_ = {}, along_ = {}, at_end_ = {}, steady_ = {};
};

}  // namespace sim
