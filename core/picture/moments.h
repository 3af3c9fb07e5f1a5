// The moments of a run in their order: in memory, or in a store that gives one at a time.
#pragma once

#include <span>
#include <vector>

#include "core/picture/model.h"

namespace sim {

class MomentStore {
 public:
  virtual ~MomentStore() = default;
  virtual std::size_t size() const = 0;
  virtual Moment get(std::size_t i) const = 0;  // from any thread
  // The same moment without the numbers of its particles: x, v, components and values are empty.
  virtual const Moment& head(std::size_t i) const = 0;
};

// A view; its source outlives it.
class Moments {
 public:
  Moments(std::span<const Moment> moments) : moments_(moments) {}
  Moments(const std::vector<Moment>& moments) : moments_(moments) {}
  Moments(const Moment* first, std::size_t count) : moments_(first, count) {}
  Moments(const MomentStore& store) : store_(&store) {}

  std::size_t size() const { return store_ ? store_->size() : moments_.size(); }
  bool empty() const { return size() == 0; }

  // The i-th: itself, or a copy of it in `room`.
  const Moment& at(std::size_t i, Moment& room) const;
  // At least the contents of MomentStore::head().
  const Frame& head(std::size_t i, std::size_t system) const;

  Moments of_system(std::size_t system) const;  // each moment has this one alone

 private:
  std::span<const Moment> moments_;
  const MomentStore* store_ = nullptr;
  int system_ = -1;  // less than 0: all
};

}  // namespace sim
