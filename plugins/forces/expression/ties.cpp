// Ties whose energy is a formula of their length.
#include <algorithm>
#include <cmath>
#include <optional>

#include "core/base/array.h"
#include "core/base/thread_pool.h"
#include "core/geometry/incidence.h"
#include "core/particles/bridges.h"
#include "core/particles/elements/element_couplings.h"
#include "distances.h"
#include "parts.h"

namespace sim::expression {
namespace {

// A force along each tie, f_a = -U'(r) d/r with d = x_a - x_b, r = |d|. Each tie is evaluated once,
// before the tiles; then every particle sums the forces of its ties.
class OfTies final : public sim::Force, public sim::Breakable {
 public:
  OfTies(const sim::Params& params, const sim::Elements& ties) {
    if (!params.has("energy"))
      refuse("fx, fy and fz do not go with ties", "give the energy of a tie as a formula of r");
    const OfBoth both(ties.carried);
    std::vector<std::string> known = {"r", "t"}, own;
    known.insert(known.end(), both.names().begin(), both.names().end());
    rest_ = !params.free_numbers().contains("rest");
    if (rest_) known.emplace_back("rest");
    for (const auto& [name, column] : ties.values)
      if ((name != "rest" || !rest_) && name != "break_strain" && name != "break_force")
        own.push_back(name);
    if (own.size() > kMostOwn)
      refuse("its ties give more than 8 numbers each", "give some to the force");
    Formulas formulas(kOwner, params, known, own);
    law_.emplace(formulas, "a tie", kFormulas);
    take(params, ties, both, own);
    take_limits(params, ties);
  }

  void bind(const sim::ParticleView& initial) override {
    places_ = sim::Incidence(initial.n, ends_);
    forces_ = sim::Array(4 * count());
    for (std::size_t tie = 0; rest_ && tie < count(); ++tie)
      if (double& rest = own_[rest_column_][tie]; std::isnan(rest))
        rest = sim::length(difference(initial, static_cast<int>(tie)));
    for (std::size_t tie = 0; tie < longest_.size(); ++tie) {
      if (std::isnan(longest_[tie])) longest_[tie] = HUGE_VAL;
      longest_[tie] = (1 + longest_[tie]) * (rest_ ? own_[rest_column_][tie] : given_rest_);
    }
  }

  void prepare(const sim::ParticleView& view, sim::ThreadPool& pool) override {
    pool.run_parts(static_cast<int>(count()), kBlock, [&](int begin, int end) {
      const auto tie_of = [begin](int i) { return begin + i; };
      evaluate(law_->slope, view, end - begin, tie_of,
               [&](int first, int many, const Distances& at, const Values& values) {
                 double* to = forces_.data() + 4 * (begin + first);
                 for (int lane = 0; lane < many; ++lane, to += 4) {
                   const double s =
                       whole(begin + first + lane) ? -at.factor(lane, values[0][lane]) : 0;
                   for (int axis = 0; axis < 3; ++axis) to[axis] = s * at.d[axis][lane];
                 }
               });
    });
  }

  void accumulate(const sim::ParticleView&, sim::Tile tile, sim::ForceSink sink) const override {
    const auto [begin, end] = places_.within(tile.begin, tile.end);
    for (int i = begin; i < end; ++i) {
      double sum[4] = {};
      for (const int place : places_.at(i)) {
        const double* const f = forces_.data() + 4 * (place / 2);
        const double sign = 1 - 2 * (place % 2);
        for (int axis = 0; axis < 4; ++axis) sum[axis] += sign * f[axis];
      }
      sink.add(i, {sum[0], sum[1], sum[2]});
    }
  }

  bool depends_on_velocity() const override { return false; }
  bool conservative() const override { return !law_->energy.reads(1); }
  bool has_jacobian() const override { return true; }

  void jacobian(const sim::ParticleView& view, sim::JacobianSink& sink) const override {
    evaluate(
        law_->slopes, view, static_cast<int>(count()), [](int i) { return i; },
        [&](int first, int many, const Distances& at, const Values& values) {
          for (int lane = 0; lane < many; ++lane) {
            if (!whole(first + lane)) continue;
            const int* const end = ends_.data() + 2 * (first + lane);
            const Mat3 k = at.curvature(lane, values[0][lane], values[1][lane]);
            sink.position(end[0], end[0], -k);
            sink.position(end[1], end[1], -k);
            sink.position(end[0], end[1], k);
            sink.position(end[1], end[0], k);
          }
        });
  }

  bool couplings(std::vector<std::array<int, 2>>& pairs) const override {
    sim::add_element_couplings(ends_, 2, pairs);
    return true;
  }

  sim::Breakable* breakable() override { return broken_.empty() ? nullptr : this; }
  int ties() const override { return static_cast<int>(count()); }
  std::array<int, 2> ends(int tie) const override {
    const int* const end = ends_.data() + 2 * tie;
    return {end[0], end[1]};
  }
  double energy(const sim::ParticleView& view, int tie) const override {
    double sum = 0;
    evaluate(
        law_->energy, view, 1, [tie](int) { return tie; },
        [&](int, int, const Distances&, const Values& values) { sum = values[0][0]; });
    return sum;
  }
  void find_overloaded(const sim::ParticleView& view, std::span<const double> /*multipliers*/,
                       std::vector<int>& out) const override {
    evaluate(
        law_->slope, view, static_cast<int>(count()), [](int i) { return i; },
        [&](int first, int many, const Distances& at, const Values& values) {
          for (int lane = 0; lane < many; ++lane) {
            const auto tie = static_cast<std::size_t>(first + lane);
            if (broken_[tie]) continue;
            if (at.r[lane] > longest_[tie] || values[0][lane] > strongest_[tie])
              out.push_back(first + lane);
          }
        });
  }
  void find_bridges(sim::TornPairs torn, std::vector<int>& out) const override {
    bridges_.find(torn, out);
  }
  // Ties that bridge particles may have to go with a tear, whatever they bear.
  void expect_tears() override {
    if (!broken_.empty() || bridges_.empty()) return;
    longest_.assign(count(), HUGE_VAL);
    strongest_.assign(count(), HUGE_VAL);
    broken_.assign(count(), 0);
  }
  void set_broken(std::span<const int> broken) override {
    std::ranges::fill(broken_, std::uint8_t{0});
    for (const int tie : broken) broken_[static_cast<std::size_t>(tie)] = 1;
  }

  double potential(const sim::ParticleView& view, sim::Tile tile) const override {
    // Each tie in the tile of its first end, in blocks.
    double sum = 0;
    int ties[kBlock], many = 0;
    const auto add = [&] {
      evaluate(
          law_->energy, view, many, [&](int i) { return ties[i]; },
          [&](int, int some, const Distances&, const Values& values) {
            for (int lane = 0; lane < some; ++lane) sum += values[0][lane];
          });
      many = 0;
    };
    const auto [begin, end] = places_.within(tile.begin, tile.end);
    for (int i = begin; i < end; ++i)
      for (const int place : places_.at(i)) {
        if (place % 2 || !whole(place / 2)) continue;
        ties[many++] = place / 2;
        if (many == kBlock) add();
      }
    add();
    return sum;
  }

 private:
  using Values = double[2][kBlock];
  static constexpr std::size_t kMostOwn = 8;  // numbers that ties give, beside their rest length
  static constexpr std::size_t kMostColumns = OfBoth::kMost + 1 + kMostOwn;

  std::size_t count() const { return ends_.size() / 2; }

  bool whole(int tie) const { return broken_.empty() || !broken_[static_cast<std::size_t>(tie)]; }

  // The limits of each tie: a strain, which bind() converts to a length, and a force, N.
  void take_limits(const sim::Params& params, const sim::Elements& ties) {
    const sim::ElementValues strain(ties, params, "break_strain"),
        force(ties, params, "break_force");
    ties.for_each([&](const sim::Element& tie) {
      longest_.push_back(strain(tie));
      strongest_.push_back(std::isnan(force(tie)) ? HUGE_VAL : force(tie));
    });
    if (std::ranges::all_of(longest_, [](double s) { return std::isnan(s); }) &&
        std::ranges::all_of(strongest_, [](double f) { return f == HUGE_VAL; })) {
      longest_.clear();
      strongest_.clear();
      return;
    }
    broken_.assign(count(), 0);
    if (!rest_) given_rest_ = params.free_numbers().at("rest");
  }

  Vec3 difference(const sim::ParticleView& view, int tie) const {
    const int* const end = ends_.data() + 2 * tie;
    return view.position(end[0]) - view.position(end[1]);
  }

  // The ties and the values of their variables. A `rest` that the scene does not give is the length
  // in the grid, or nan until bind() measures it.
  void take(const sim::Params& params, const sim::Elements& ties, const OfBoth& both,
            const std::vector<std::string>& own) {
    ties.for_each([&](const sim::Element& tie) {
      bridges_.add(static_cast<int>(count()), tie.ids[0], tie.ids[1], tie.parts);
      ends_.insert(ends_.end(), tie.ids.begin(), tie.ids.end());
    });
    for (std::size_t column = 0; column < both.size(); ++column) {
      std::vector<double>& values = own_.emplace_back();
      for (std::size_t tie = 0; tie < count(); ++tie)
        values.push_back(both.of(column, {ends_[2 * tie], ends_[2 * tie + 1]}));
    }
    rest_column_ = own_.size();
    if (rest_) {
      const sim::ElementValues rest(ties, params, "rest");
      std::vector<double>& column = own_.emplace_back();
      ties.for_each([&](const sim::Element& tie) {
        column.push_back(std::isnan(rest(tie)) ? tie.length : rest(tie));
      });
    }
    for (const std::string& name : own) {
      const sim::ElementValues values(ties, params, name);
      std::vector<double>& column = own_.emplace_back();
      ties.for_each([&](const sim::Element& tie) {
        column.push_back(values(tie));
        if (std::isnan(column.back()))
          refuse("tie " + std::to_string(column.size()) + " gives no " + name,
                 "give " + name + " to the force or to every tie");
      });
    }
  }

  // Calls visit(first, many, distances, values) for `all` ties, block by block.
  template <class TieOf, class Visit>
  void evaluate(const Program& program, const sim::ParticleView& view, int all, TieOf tie_of,
                const Visit& visit) const {
    Distances at;
    alignas(64) double values[2][kBlock], t[kBlock], own[kMostColumns][kBlock];
    std::fill(t, t + kBlock, view.t);
    const double* inputs[2 + kMostColumns] = {at.r, t};
    for (std::size_t i = 0; i < own_.size(); ++i) inputs[i + 2] = own[i];
    double* const outputs[] = {values[0], values[1]};
    for (int first = 0; first < all; first += kBlock) {
      const int many = std::min(kBlock, all - first);
      for (int lane = 0; lane < many; ++lane) at.take(lane, difference(view, tie_of(first + lane)));
      at.measure(many);
      for (std::size_t i = 0; i < own_.size(); ++i) {
        if (!program.reads(static_cast<int>(i) + 2)) continue;
        for (int lane = 0; lane < kBlock; ++lane) {
          const int tie = tie_of(first + std::min(lane, many - 1));
          own[i][lane] = own_[i][static_cast<std::size_t>(tie)];
        }
      }
      program.run(inputs, outputs, many);
      visit(first, many, at, values);
    }
  }

  std::optional<sim::RadialEnergy> law_;
  std::vector<int> ends_;                 // two a tie
  std::vector<std::vector<double>> own_;  // a variable, of each tie
  bool rest_ = false;                     // one of them is `rest`, measured where it is not given:
  std::size_t rest_column_ = 0;
  double given_rest_ = 0;                    // m, of all, where the force gives it
  std::vector<double> longest_, strongest_;  // m, N: the limits of ties, if some may break
  std::vector<std::uint8_t> broken_;         // of each tie, likewise
  sim::Bridges bridges_;
  sim::Incidence places_;  // in ends_, of each particle
  sim::Array forces_;      // N, on the first end of each tie; four numbers each
};

}  // namespace

std::unique_ptr<Force> make_of_ties(const Params& params, const Elements& ties) {
  return std::make_unique<OfTies>(params, ties);
}

}  // namespace sim::expression
