// The work of contact in the steps of a system: summed particle by particle, on all threads.
#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

namespace sim {

// Energy per mass lost in contact and given by moving surfaces, J/kg (in a StepPath: (m/step)^2).
struct ContactWork {
  double lost = 0, given = 0;
};

// Sums are kept for blocks of particles and added in their order, so that threads change no bit.
class ContactWorkSums {
 public:
  explicit ContactWorkSums(int n)
      : blocks_(static_cast<std::size_t>(n / kBlock + 1)), touched_(static_cast<std::size_t>(n)) {}

  // Adds the work of contact on particle i in one step, J; called by the one thread that owns its
  // block.
  void enter(int i, double mass, const ContactWork& work) {
    ContactWork& sum = blocks_[static_cast<std::size_t>(i / kBlock)];
    sum.lost += mass * work.lost;
    sum.given += mass * work.given;
    touched_[static_cast<std::size_t>(i)] = 1;
    any_.store(true, std::memory_order_relaxed);
  }

  // For callers that enter several particles in their order: the sum of particle i, the same for
  // eight from a multiple of 8 on, and a mark that it was entered.
  ContactWork& sum_of(int i) { return blocks_[static_cast<std::size_t>(i / kBlock)]; }
  void mark(int i) {
    touched_[static_cast<std::size_t>(i)] = 1;
    any_.store(true, std::memory_order_relaxed);
  }

  // The work, J, since the last call: lost in contact, and given by moving surfaces.
  ContactWork take() {
    ContactWork sum;
    if (!any_.exchange(false)) return sum;
    for (ContactWork& block : blocks_) {
      sum.lost += block.lost;
      sum.given += block.given;
      block = {};
    }
    return sum;
  }

  bool any() const { return any_.load(std::memory_order_relaxed); }  // since then
  bool touched(int i) const { return touched_[static_cast<std::size_t>(i)]; }  // ever

  // Counts steps with so many impacts that they were not cut at each one, although asked to.
  void count_uncut() { ++uncut_; }
  std::int64_t uncut() const { return uncut_; }

  // The first over-constrained particle of this step, which could not be moved out of all
  // colliders; -1: none.
  void refuse(int i) {
    int known = over_constrained_.load();
    while ((known < 0 || i < known) && !over_constrained_.compare_exchange_weak(known, i)) {}
  }
  int over_constrained() const { return over_constrained_.load(); }
  void begin_step() { over_constrained_.store(-1); }

 private:
  static constexpr int kBlock = 16;  // threads share none

  std::vector<ContactWork> blocks_;
  std::vector<std::uint8_t> touched_;
  std::atomic<bool> any_{false};
  std::atomic<int> over_constrained_{-1};
  std::int64_t uncut_ = 0;
};

}  // namespace sim
