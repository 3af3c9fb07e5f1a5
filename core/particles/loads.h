// Constant forces, one for each particle.
#pragma once

#include <utility>
#include <vector>

#include "core/particles/force.h"

namespace sim {

class Loads final : public Force {
 public:
  explicit Loads(std::vector<Vec3> forces) : forces_(std::move(forces)) {}  // N, of every particle

  void accumulate(const ParticleView& /*view*/, Tile tile, ForceSink sink) const override {
    for (int i = tile.begin; i < tile.end; ++i) sink.add(i, forces_[static_cast<std::size_t>(i)]);
  }

  bool depends_on_velocity() const override { return false; }

  double potential(const ParticleView& view, Tile tile) const override {
    double sum = 0;
    for (int i = tile.begin; i < tile.end; ++i)
      if (view.free(i)) sum -= forces_[static_cast<std::size_t>(i)].dot(view.position(i));
    return sum;
  }

 private:
  std::vector<Vec3> forces_;
};

}  // namespace sim
