#include "pair_forces.h"

#include "core/base/assert.h"
#include "core/simd/inverse_sqrt.h"

namespace sim {

PairLaw shifted(PairLaw law, bool slope) {
  PairTerms terms;
  const double rr = law.cutoff * law.cutoff;
  const double squares[8] = {rr, rr, rr, rr, rr, rr, rr, rr};
  PairLaw whole = law;
  whole.cutoff = 2 * law.cutoff;  // terms are 0 from there on
  pair_kernels(law).terms(whole, squares, terms);
  law.energy_shift = terms.u[0];
  if (slope) law.slope_shift = -terms.g[0] * law.cutoff;
  return law;
}

PairForces::PairForces(const PairLaw& law, double skin)
    : law_(law), kernels_(pair_kernels(law)), neighbours_(law.cutoff, skin) {}

void PairForces::prepare(const ParticleView& view, ThreadPool& pool) {
  if (!neighbours_.update(view, pool) && forces_.size() > 0) return;
  energies_known_ = energies_asked_;
  energies_asked_ = false;
  const auto blocks = neighbours_.blocks();
  if (forces_.size() == 0) forces_ = Array(32 * blocks.size());
  pool.run_parts(static_cast<int>(8 * blocks.size()), 8, [&](int begin, int end) {
    kernels_.forces(law_, blocks.data(), neighbours_.points(), begin / 8, end / 8, forces_.data(),
                    energies_known_ ? energies_.data() : nullptr);
  });
}

void PairForces::add(Tile tile, ForceSink sink) const {
  SIM_ASSERT(tile.begin >= 0 && 4 * static_cast<std::size_t>(tile.end) <= forces_.size());
  for (int i = tile.begin; i < tile.end; ++i) {
    const double* const force = forces_.data() + 4 * std::ptrdiff_t{neighbours_.place(i)};
    sink.x[i] += force[0];
    sink.y[i] += force[1];
    sink.z[i] += force[2];
  }
}

double PairForces::potential(Tile tile) const {
  energies_asked_ = true;
  if (!energies_known_) {
    const auto blocks = neighbours_.blocks();
    if (energies_.size() == 0) energies_ = Array(8 * blocks.size());
    kernels_.forces(law_, blocks.data(), neighbours_.points(), 0, static_cast<int>(blocks.size()),
                    nullptr, energies_.data());
    energies_known_ = true;
  }
  double sum = 0;
  for (int i = tile.begin; i < tile.end; ++i) sum += energies_.data()[neighbours_.place(i)];
  return sum;
}

// Calls f(ids, count, d, terms) for up to eight neighbours of i at a time.
template <class F>
void PairForces::for_each_eight(const ParticleView& view, int i, const F& f) const {
  int ids[8], count = 0;
  Vec3 d[8];
  double squares[8] = {};
  PairTerms terms;
  const auto flush = [&] {
    kernels_.terms(law_, squares, terms);
    f(ids, count, d, terms);
    count = 0;
  };
  neighbours_.for_each(i, [&](int j) {
    d[count] = view.position(i) - view.position(j);
    squares[count] = square_of(d[count].x(), d[count].y(), d[count].z());
    ids[count] = j;
    if (++count == 8) flush();
  });
  if (count > 0) flush();
}

// f_i = g d: df_i/dx_i = -df_i/dx_j = g I + 2 dg/d(r^2) d d^T.
void PairForces::jacobian(const ParticleView& view, JacobianSink& sink) const {
  for (int i = 0; i < view.n; ++i) {
    Mat3 own = Mat3::Zero();
    const auto add = [&](const int* ids, int count, const Vec3* d, const PairTerms& terms) {
      for (int k = 0; k < count; ++k) {
        if (terms.g[k] == 0 && terms.dg[k] == 0) continue;  // beyond the cutoff
        const Mat3 block = terms.g[k] * Mat3::Identity() + outer(2 * terms.dg[k] * d[k], d[k]);
        sink.position(i, ids[k], -block);
        own += block;
      }
    };
    for_each_eight(view, i, add);
    sink.position(i, i, own);
  }
}

}  // namespace sim
