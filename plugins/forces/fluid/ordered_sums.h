// Sums over the particles of a fluid in the order of their ids, on all threads.
#pragma once

#include <algorithm>
#include <vector>

#include "core/base/thread_pool.h"

namespace sim {

// Neighbour lists put particles in places that depend on the past; the bits of a sum must not.
class OrderedSums {
 public:
  OrderedSums() = default;
  explicit OrderedSums(int n)
      : n_(n), parts_(static_cast<std::size_t>((n + kParticles - 1) / kParticles)) {}

  // The sum of term(place) over the places of all particles; rows.place(k): that of the k-th.
  template <class Rows, class Term>
  double operator()(const Rows& rows, ThreadPool& pool, const Term& term) {
    pool.run_parts(static_cast<int>(parts_.size()), 1, [&](int begin, int end) {
      for (int part = begin; part < end; ++part) {
        double sum = 0;
        const int last = std::min(n_, kParticles * (part + 1));
        for (int k = kParticles * part; k < last; ++k) sum += term(rows.place(k));
        parts_[static_cast<std::size_t>(part)] = sum;
      }
    });
    double sum = 0;
    for (const double part : parts_) sum += part;
    return sum;
  }

 private:
  static constexpr int kParticles = 512;  // a partial sum

  int n_ = 0;
  std::vector<double> parts_;
};

}  // namespace sim
