#include "core/particles/subset.h"

#include <algorithm>

namespace sim {

Subset::Subset(std::span<const int> ids) : count_(static_cast<int>(ids.size())) {
  for (const int id : ids)
    if (!ranges_.empty() && ranges_.back()[1] == id)
      ++ranges_.back()[1];
    else
      ranges_.push_back({id, id + 1});
}

int Subset::id(int i) const {
  for (const auto& [begin, end] : ranges_) {
    if (i < end - begin) return begin + i;
    i -= end - begin;
  }
  return -1;
}

void Subset::gather(const Layout& all, const double* from, double* to) const {
  const Layout few(count_);
  for (int block = 0; block < 6; ++block) {
    double* out = few.block(to, block);
    for (const auto& [begin, end] : ranges_)
      out = std::copy(all.block(from, block) + begin, all.block(from, block) + end, out);
  }
}

void Subset::scatter(const double* from, const Layout& all, double* to) const {
  const Layout few(count_);
  for (int block = 0; block < 6; ++block) {
    const double* in = few.block(from, block);
    for (const auto& [begin, end] : ranges_) {
      std::copy(in, in + (end - begin), all.block(to, block) + begin);
      in += end - begin;
    }
  }
}

double Subset::kinetic_energy(const ParticleView& all) const {
  double twice = 0;
  for (const auto& [begin, end] : ranges_)
    for (int i = begin; i < end; ++i) {
      const double square = all.vx[i] * all.vx[i] + all.vy[i] * all.vy[i] + all.vz[i] * all.vz[i];
      twice += square > 0 ? all.mass[i] * square : 0;
    }
  return 0.5 * twice;
}

}  // namespace sim
