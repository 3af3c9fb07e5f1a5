// Forces of elements (pairs, triangles, ...) on the particles they join: each element is evaluated
// once, before the tiles, and every particle then gathers its share in one fixed order.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "core/base/thread_pool.h"
#include "core/geometry/incidence.h"
#include "core/particles/view.h"

namespace sim {

template <int kArity>
class ElementForces {
 public:
  using Forces = std::array<Vec3, kArity>;  // N, on each particle of an element

  ElementForces() = default;
  // n particles; kArity ids for each element, in [0, n).
  ElementForces(int n, std::span<const int> ids)
      : incidence_(n, ids), forces_(ids.size() / kArity) {}

  // For Force::prepare(): force_of(e) gives the Forces of element e. It runs on several threads.
  template <class ForceOf>
  void evaluate(ThreadPool& pool, const ForceOf& force_of) {
    pool.run_parts(static_cast<int>(forces_.size()), 1, [&](int begin, int end) {
      for (int e = begin; e < end; ++e) forces_[static_cast<std::size_t>(e)] = force_of(e);
    });
  }

  // For Force::accumulate(): adds up in the order of the elements.
  void add(Tile tile, ForceSink sink) const {
    const auto [begin, end] = incidence_.within(tile.begin, tile.end);
    for (int i = begin; i < end; ++i) {
      Vec3 sum = Vec3::Zero();
      for (const int place : incidence_.at(i))
        sum += forces_[static_cast<std::size_t>(place / kArity)]
                      [static_cast<std::size_t>(place % kArity)];
      sink.add(i, sum);
    }
  }

  // Calls visit(e) for the elements whose first particle is in the tile: each is in exactly one.
  template <class Visit>
  void for_each(Tile tile, const Visit& visit) const {
    const auto [begin, end] = incidence_.within(tile.begin, tile.end);
    for (int i = begin; i < end; ++i)
      for (const int place : incidence_.at(i))
        if (place % kArity == 0) visit(place / kArity);
  }

 private:
  Incidence incidence_;
  std::vector<Forces> forces_;
};

}  // namespace sim
