// The sweeps of one step over the particles: their rings, their threads, their order.
#pragma once

#include <vector>

#include "core/particles/explicit/wavefront.h"
#include "core/particles/particles.h"

namespace sim {

template <class Real>
class Sweeps {
 public:
  Sweeps(Particles& system, int most_stages);

  // Runs `stages` stages. q(stage) is the array of three positions a stage reads, or null if it
  // evaluates no forces; sweep(rings, stage, begin, end) does a part and returns whether it is
  // finite. False if one was not.
  template <class Q, class Sweep>
  bool run(int stages, const Q& q, const Sweep& sweep) {
    return run_pieces(
        stages,
        [&](int rank, int ranks, int stage, int begin) {
          start(rank, ranks, stage, begin, q(stage));
        },
        [&](int rank, int stage, int begin, int end) {
          return sweep(rings(rank, stage), stage, begin, end);
        });
  }

  // The same with other forces that can all be swept: before each piece they are gathered into
  // `sink`, at view(stage).
  template <class Q, class View, class Sweep>
  bool run_gathering(int stages, const Q& q, const View& view, ForceSink sink, const Sweep& sweep) {
    return run_pieces(
        stages,
        [&](int rank, int ranks, int stage, int begin) {
          start(rank, ranks, stage, begin, q(stage));
          if (q(stage))
            for (const auto& force : forces_[place(rank, stage)]) force->start(view(stage), begin);
        },
        [&](int rank, int stage, int first, int last) {
          bool good = true;
          for (int begin = first; begin < last; begin += kGatherTile) {
            if (gives_up(rank, stage)) break;
            const Tile tile{begin, std::min(begin + kGatherTile, last)};
            if (q(stage)) gather(rank, stage, view(stage), tile, sink);
            good &= sweep(rings(rank, stage), stage, tile.begin, tile.end);
          }
          return good;
        });
  }

  // One stage, complete on every rank when it returns; before each piece the other forces at `view`
  // are gathered into `sink`, unless q is null.
  template <class Sweep>
  bool run_alone(int stage, const ParticleView& view, ForceSink sink, const Real* const* q,
                 const Sweep& sweep) {
    std::fill(finite_.begin(), finite_.end(), char{1});
    if (q) system_->prepare_gather(view);
    const int ranks = useful_ranks(1, system_->pool().size());
    system_->pool().run([&](int rank) {
      if (rank >= ranks) return;
      const Part part = part_of(view.n, kGrain, rank, ranks);
      start(rank, ranks, stage, part.begin, q);
      for (int begin = part.begin; begin < part.end; begin += kGatherTile) {
        if (gives_up(rank, stage)) break;
        const int end = std::min(begin + kGatherTile, part.end);
        if (q) system_->gather(view, {begin, end}, sink);
        if (!sweep(rings(rank, stage), stage, begin, end))
          finite_[static_cast<std::size_t>(rank)] = 0;
      }
    });
    return finite();
  }

 private:
  // Runs the stages of all ranks, piece by piece: begin_at() is called where a rank starts a stage,
  // and piece() returns whether it is finite. Pieces that are given up are left out.
  template <class BeginAt, class Piece>
  bool run_pieces(int stages, const BeginAt& begin_at, const Piece& piece) {
    std::fill(finite_.begin(), finite_.end(), char{1});
    const int ranks = useful_ranks(stages, system_->pool().size());
    wavefront_.run(
        system_->pool(), stages, ranks,
        [&](int rank, int stage, int begin) { begin_at(rank, ranks, stage, begin); },
        [&](int rank, int stage, int begin, int end) {
          if (one_pass_ && gives_up(rank, stage)) return;
          if (!piece(rank, stage, begin, end)) finite_[static_cast<std::size_t>(rank)] = 0;
        });
    return finite();
  }

  // The rest of such a sweep is left out: its rings are not empty then.
  bool gives_up(int rank, int stage) {
    if (!system_->pool().gives_up(rank)) return false;
    rings(rank, stage).of_part = true;
    return true;
  }
  std::size_t place(int rank, int stage) const {
    return static_cast<std::size_t>(one_pass_ ? rank * most_stages_ + stage : rank);
  }
  Rings<Real>& rings(int rank, int stage) { return rings_[place(rank, stage)]; }
  void gather(int rank, int stage, const ParticleView& view, Tile tile, ForceSink sink);
  int most_ranks() const { return useful_ranks(1, system_->pool().most()); }
  int useful_ranks(int stages, int members) const;
  void start(int rank, int ranks, int stage, int begin, const Real* const* q);
  bool finite() const;

  Particles* system_;
  SweepKernels<Real> kernels_ = sweep_kernels<Real>();
  int most_stages_;
  bool one_pass_;  // all stages in one pass over the particles, each with rings of its own
  Wavefront wavefront_;
  std::vector<Rings<Real>> rings_;
  std::vector<std::vector<std::unique_ptr<ForceSweep>>> forces_;  // of each of those
  std::vector<char> finite_;                                      // of each rank
};

}  // namespace sim
