// Wavefronts: the order in which the stages of a step go over the particles.
#pragma once

#include <algorithm>
#include <atomic>
#include <memory>

#include "core/base/thread_pool.h"
#include "core/particles/explicit/sweep.h"

namespace sim {

// A stage at particle i reads the output of the stage before, from i - reach to i + reach only, and
// may overwrite the input of that one. So a stage may run over the particles while the one before
// is `reach` ahead, and the data of all stages stay in cache. Rank r of a thread pool takes the
// particles from m_r + s reach on at stage s: with that skew it never waits for the rank below, and
// that rank finds the data it needs when it gets there.
class Wavefront {
 public:
  static constexpr int kMostStages = 32;

  // reach: a multiple of kGrain. ahead: the number of particles that a stage advances at a time.
  Wavefront(int n, int reach, int most_stages, int most_ranks, int ahead)
      : n_(n),
        reach_(reach),
        ahead_(ahead),
        progress_(
            std::make_unique<Progress[]>(static_cast<std::size_t>(most_stages * most_ranks))) {}

  // Calls start(rank, stage, begin) once and sweep(rank, stage, begin, end) piece by piece, for
  // every stage of every rank; all pieces but the last are multiples of kGrain.
  template <class Start, class Sweep>
  void run(ThreadPool& pool, int stages, int ranks, const Start& start, const Sweep& sweep) {
    stages_ = stages;
    ranks_ = ranks;
    for (int i = 0; i < stages_ * ranks_; ++i)
      progress_[i].done.store(0, std::memory_order_relaxed);
    if (ranks_ == 1) return run_rank(0, start, sweep);
    pool.run([&](int rank) {
      if (rank < ranks_) run_rank(rank, start, sweep);
    });
  }

 private:
  struct alignas(64) Progress {
    std::atomic<int> done{0};  // the stage is finished for the particles of its rank below this
  };

  Progress& progress(int rank, int stage) { return progress_[rank * stages_ + stage]; }

  // The first particle of a rank at a stage. The skew is centred, so that the first and the last
  // rank have as much work as the others.
  int first(int rank, int stage) const {
    if (rank == 0) return 0;
    if (rank == ranks_) return n_;
    const int middle = (stages_ - 1) * reach_ / 2 / kGrain * kGrain;
    return part_of(n_, kGrain, rank, ranks_).begin + stage * reach_ - middle;
  }

  template <class Start, class Sweep>
  void run_rank(int rank, const Start& start, const Sweep& sweep) {
    int at[kMostStages], end[kMostStages];
    for (int s = 0; s < stages_; ++s) {
      at[s] = first(rank, s);
      end[s] = first(rank + 1, s);
    }
    while (at[stages_ - 1] < end[stages_ - 1])
      for (int s = 0; s < stages_; ++s) {
        // The positions of the stage are known up to here: `reach` behind the stage before, or,
        // when that one is done, into the particles that the next rank has done first of all.
        int limit = end[s];
        if (s == 0) {
          limit = std::min(limit, at[0] + ahead_);
        } else if (at[s - 1] < end[s - 1]) {
          limit = std::min(limit, at[s - 1] - reach_);
        } else if (rank + 1 < ranks_) {
          const std::atomic<int>& needed = progress(rank + 1, s - 1).done;
          for (int spin = 0; needed.load(std::memory_order_acquire) < std::min(n_, end[s] + reach_);
               ++spin)
            wait_a_little(spin);
        }
        if (limit <= at[s]) continue;
        if (at[s] == first(rank, s)) start(rank, s, at[s]);
        sweep(rank, s, at[s], limit);
        at[s] = limit;
        progress(rank, s).done.store(limit, std::memory_order_release);
      }
  }

  int n_, reach_, ahead_, stages_ = 0, ranks_ = 0;
  std::unique_ptr<Progress[]> progress_;
};

}  // namespace sim
