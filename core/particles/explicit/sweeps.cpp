#include "core/particles/explicit/sweeps.h"

#include <algorithm>

#include "core/base/assert.h"

namespace sim {
namespace {

constexpr int kAhead = 2048;        // particles that a stage goes forward at a time
constexpr int kOnePassFrom = 8192;  // particles; fewer stay in the second-level cache anyway
constexpr int kLeastPart = 64;      // particles a rank

bool one_pass(const Particles& system) {
  return (!system.has_other_forces() || system.sweeps_other_forces()) &&
         system.layout().n() >= kOnePassFrom;
}

}  // namespace

template <class Real>
Sweeps<Real>::Sweeps(Particles& system, int most_stages)
    : system_(&system),
      most_stages_(most_stages),
      one_pass_(one_pass(system)),
      wavefront_(system.layout().n(), system.reach(), most_stages, most_ranks(),
                 one_pass_ ? kAhead : system.layout().n()) {
  for (int i = 0; i < most_ranks() * (one_pass_ ? most_stages : 1); ++i)
    rings_.push_back(Rings<Real>(system.runs()));
  if (system.sweeps_other_forces()) forces_.resize(rings_.size());
  for (auto& sweeps : forces_)
    for (const Force* force : system.other_forces()) sweeps.push_back(force->sweep());
  finite_.resize(static_cast<std::size_t>(most_ranks()));
}

// The skew of many stages occupies particles too.
template <class Real>
int Sweeps<Real>::useful_ranks(int stages, int members) const {
  const int least = std::max(kLeastPart, (stages + 2) * system_->reach());
  return std::clamp(system_->layout().n() / least, 1, members);
}

template <class Real>
void Sweeps<Real>::start(int rank, int ranks, int stage, int begin, const Real* const* q) {
  SIM_ASSERT(0 <= rank && rank < ranks && 0 <= stage && stage < most_stages_);
  if (q) kernels_.start(rings(rank, stage), ranks, q, begin, system_->reach());
}

template <class Real>
void Sweeps<Real>::gather(int rank, int stage, const ParticleView& view, Tile tile,
                          ForceSink sink) {
  SIM_ASSERT(0 <= tile.begin && tile.begin <= tile.end && tile.end <= view.n);
  for (double* const sum : {sink.x, sink.y, sink.z})
    std::fill(sum + tile.begin, sum + (tile.end + 7) / 8 * 8, 0.0);
  for (const auto& force : forces_[place(rank, stage)]) force->add(view, tile, sink);
}

template <class Real>
bool Sweeps<Real>::finite() const {
  return std::find(finite_.begin(), finite_.end(), char{0}) == finite_.end();
}

template class Sweeps<double>;
template class Sweeps<float>;

}  // namespace sim
