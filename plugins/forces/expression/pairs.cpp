// Pairs whose energy is a formula of their distance.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/base/thread_pool.h"
#include "core/particles/neighbours/neighbours.h"
#include "distances.h"
#include "pair_programs.h"
#include "pair_rows.h"
#include "parts.h"

namespace sim::expression {
namespace {

// A force between any two particles, or those closer than the cutoff, f_i = -U'(r) d/r with
// d = x_i - x_j. Each pair is evaluated from both its ends with the lower id first, which gives
// exactly opposite forces whatever the formula.
class OfPairs final : public sim::Force {
 public:
  OfPairs(const sim::Params& params, const Carried& carried) : both_(carried) {
    if (!params.has("energy"))
      refuse("fx, fy and fz do not go with pairs", "give the energy of a pair as a formula of r");
    if (params.has("cutoff")) {
      cutoff_ = params.number("cutoff");
      if (!(cutoff_ > 0)) refuse("its cutoff is 0", "give cutoff > 0 in m");
      neighbours_.emplace(cutoff_, params.has("skin") ? params.number("skin") : 0.2 * cutoff_);
    }
    std::vector<std::string> known = {"r", "t"};
    known.insert(known.end(), both_.names().begin(), both_.names().end());
    Formulas formulas(kOwner, params, known);
    law_.emplace(formulas, "a pair", kFormulas);
    if (!neighbours_) return;
    listed_ = PairPrograms(formulas, formulas.read("energy", "a pair"));
    kernels_ = pair_row_kernels(listed_.of_square);
  }

  // Checks here already that the neighbour lists fit into memory.
  void bind(const sim::ParticleView& initial) override {
    sim::ThreadPool alone(1);
    if (neighbours_) neighbours_->update(initial, alone);
    forces_.resize(static_cast<std::size_t>(initial.n));
    if (neighbours_) energies_.resize(static_cast<std::size_t>(initial.n));
  }

  void prepare(const sim::ParticleView& view, sim::ThreadPool& pool) override {
    const bool moved = neighbours_ ? neighbours_->update(view, pool) : has_moved(view);
    if (!moved && known_ && conservative()) return;
    known_ = true;
    energies_known_ = false;
    if (neighbours_) {
      pool.run_parts(8 * static_cast<int>(neighbours_->blocks().size()), 8,
                     [&](int begin, int end) { evaluate_lists(view.t, begin / 8, end / 8); });
      return;
    }
    pool.run_parts(view.n, 8, [&](int begin, int end) {
      std::fill(forces_.begin() + begin, forces_.begin() + end, Vec3(0, 0, 0));
      evaluate(law_->slope, view, {begin, end}, kAll,
               [&](int i, int, int lane, const Distances& at, const Values& values) {
                 forces_[static_cast<std::size_t>(i)] -=
                     at.factor(lane, values[0][lane]) * at.at(lane);
               });
    });
  }

  void accumulate(const sim::ParticleView&, sim::Tile tile, sim::ForceSink sink) const override {
    for (int i = tile.begin; i < tile.end; ++i) sink.add(i, forces_[static_cast<std::size_t>(i)]);
  }

  bool depends_on_velocity() const override { return false; }
  bool conservative() const override { return !law_->energy.reads(1); }

  bool has_jacobian() const override { return true; }
  void jacobian(const sim::ParticleView& view, sim::JacobianSink& sink) const override {
    evaluate(law_->slopes, view, {0, view.n}, kAll,
             [&](int i, int j, int lane, const Distances& at, const Values& values) {
               const Mat3 k = at.curvature(lane, values[0][lane], values[1][lane]);
               sink.position(i, i, -k);
               sink.position(i, j, k);
             });
  }

  double potential(const sim::ParticleView& view, sim::Tile tile) const override {
    double sum = 0;
    if (neighbours_) {
      if (!energies_known_) list_energies(view.t);
      for (int i = tile.begin; i < tile.end; ++i) sum += energies_[static_cast<std::size_t>(i)];
      return sum;
    }
    evaluate(law_->energy, view, tile, kUpwards,
             [&](int, int, int lane, const Distances&, const Values& u) { sum += u[0][lane]; });
    return sum;
  }

 private:
  using Values = double[2][kBlock];
  using Ends = std::array<int, 2>;
  enum Which { kAll, kUpwards };  // neighbours of a particle: those with a higher id

  // Without neighbour lists: true if a particle has moved since the last call.
  bool has_moved(const sim::ParticleView& view) {
    const auto n = static_cast<std::size_t>(view.n);
    const double* const now[] = {view.x, view.y, view.z};
    bool moved = last_.size() != 3 * n;
    last_.resize(3 * n);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double* const last = last_.data() + axis * n;
      moved = moved || !std::equal(last, last + n, now[axis]);
      std::copy_n(now[axis], n, last);
    }
    return moved;
  }

  // Calls add(rows, values, count) for rows of entries of the lists of a block, by ascending id.
  template <class Add>
  void for_each_rows(const Program& program, double t, int b, const Add& add) const {
    PairRows rows;
    alignas(64) double values[kBlock], times[kBlock], own[OfBoth::kMost][kBlock];
    if (program.reads(1)) std::fill(times, times + kBlock, t);
    const double* inputs[3 + OfBoth::kMost] = {rows.measure, times};
    for (std::size_t column = 0; column < both_.size(); ++column) inputs[column + 2] = own[column];
    inputs[both_.size() + 2] = rows.inverse;
    double* const outputs[] = {values};
    const sim::NeighbourBlock& block = neighbours_->blocks()[static_cast<std::size_t>(b)];
    const int most = kBlock / 8;
    for (int first = 0; first < block.length; first += most) {
      const int count = std::min(most, block.length - first);
      kernels_.measure(block, b, neighbours_->points(), first, count, cutoff_, rows);
      for (std::size_t column = 0; column < both_.size(); ++column) {
        if (!program.reads(static_cast<int>(column) + 2)) continue;
        for (int at = 0; at < 8 * count; ++at)
          own[column][at] = both_.of(column, ends_of(block, 8 * b, 8 * first + at));
      }
      program.run(inputs, outputs, 8 * count);
      add(rows, values, count);
    }
  }

  // The two ids of an entry of the lists of a block, the lower one first; 0 and 0 of one that only
  // fills up a list.
  Ends ends_of(const sim::NeighbourBlock& block, int place, int entry) const {
    const int lane = entry % 8;
    if (entry / 8 >= block.count[lane]) return {};
    const auto [low, high] =
        std::minmax({neighbours_->id(place + lane), neighbours_->id(block.slots[entry])});
    return {{low, high}};
  }

  // The forces on the particles of blocks [begin, end).
  void evaluate_lists(double t, int begin, int end) {
    for (int b = begin; b < end; ++b) {
      double sums[3][8] = {};
      for_each_rows(listed_.factor, t, b,
                    [&](const PairRows& rows, const double* slopes, int count) {
                      kernels_.add(rows, slopes, count, cutoff_, sums);
                    });
      for_each_particle(b, [&](std::size_t i, int lane) {
        forces_[i] = {sums[0][lane], sums[1][lane], sums[2][lane]};
      });
    }
  }

  // Each particle has half the energy of its pairs.
  void list_energies(double t) const {
    energies_known_ = true;
    for (int b = 0; b < std::ssize(neighbours_->blocks()); ++b) {
      double sums[8] = {};
      for_each_rows(listed_.energy, t, b, [&](const PairRows& rows, const double* u, int count) {
        kernels_.add_energies(rows, u, count, cutoff_, sums);
      });
      for_each_particle(b, [&](std::size_t i, int lane) { energies_[i] = sums[lane]; });
    }
  }

  // Calls f(id, lane) for the particles of a block.
  template <class F>
  void for_each_particle(int b, const F& f) const {
    for (int lane = 0; lane < 8 && 8 * b + lane < std::ssize(forces_); ++lane)
      f(static_cast<std::size_t>(neighbours_->id(8 * b + lane)), lane);
  }

  // Calls visit(i, j, lane, distances, values) for the neighbours j of each particle i of a tile,
  // both ascending.
  template <class Visit>
  void evaluate(const Program& program, const sim::ParticleView& view, sim::Tile tile, Which which,
                const Visit& visit) const {
    Distances at;
    alignas(64) double values[2][kBlock], t[kBlock], own[OfBoth::kMost][kBlock];
    std::fill(t, t + kBlock, view.t);
    const double* inputs[2 + OfBoth::kMost] = {at.r, t};
    std::size_t read[OfBoth::kMost], reads = 0;
    for (std::size_t column = 0; column < both_.size(); ++column) {
      inputs[column + 2] = own[column];
      if (program.reads(static_cast<int>(column) + 2)) read[reads++] = column;
    }
    double* const outputs[] = {values[0], values[1]};
    Ends ends[kBlock];
    int many = 0;
    const auto flush = [&] {
      at.measure(many);
      for (std::size_t k = 0; k < reads; ++k)
        for (int lane = 0; lane < kBlock; ++lane) {
          const Ends& pair = ends[std::min(lane, many - 1)];
          own[read[k]][lane] =
              both_.of(read[k], {std::min(pair[0], pair[1]), std::max(pair[0], pair[1])});
        }
      program.run(inputs, outputs, many);
      for (int lane = 0; lane < many; ++lane)
        if (at.r[lane] < cutoff_) visit(ends[lane][0], ends[lane][1], lane, at, values);
      many = 0;
    };
    const auto add = [&](int i, int j) {
      if (which == kUpwards && j < i) return;
      ends[many] = {i, j};
      at.take(many++, view.position(i) - view.position(j));
      if (many == kBlock) flush();
    };
    for (int i = tile.begin; i < tile.end; ++i) {
      if (neighbours_) {
        neighbours_->for_each(i, [&](int j) { add(i, j); });
        continue;
      }
      for (int j = which == kUpwards ? i + 1 : 0; j < view.n; ++j)
        if (j != i) add(i, j);
    }
    if (many > 0) flush();
  }

  OfBoth both_;
  double cutoff_ = HUGE_VAL;
  std::optional<sim::Neighbours> neighbours_;  // with a cutoff
  std::vector<double> last_;                   // without: where all were
  std::optional<sim::RadialEnergy> law_;
  PairPrograms listed_;  // of the law, for pairs of lists
  PairRowKernels kernels_ = {};
  std::vector<Vec3> forces_;
  bool known_ = false;                    // the forces, at the positions of the lists
  mutable std::vector<double> energies_;  // with a cutoff, once asked for
  mutable bool energies_known_ = false;   // at these positions
};

}  // namespace

std::unique_ptr<Force> make_of_pairs(const Params& params, const Carried& carried) {
  return std::make_unique<OfPairs>(params, carried);
}

}  // namespace sim::expression
