// Forces as formulas: of ties, of pairs, of each particle by itself, differentiated and compiled.
#include <algorithm>
#include <cmath>

#include "core/base/array.h"
#include "core/base/team.h"
#include "core/particles/elements/distances.h"
#include "core/particles/elements/incidence.h"
#include "core/particles/neighbours/neighbours.h"
#include "core/plugin/formulas.h"
#include "core/plugin/plugin.h"

namespace {

using sim::Distances;
using sim::Formulas;
using sim::Mat3;
using sim::Program;
using sim::Vec3;

constexpr int kBlock = Program::kBlock;

const char* const kOwner = "force 'expression'";
const std::vector<std::string> kFormulas = {"energy", "fx", "fy", "fz", "cutoff", "skin"};

[[noreturn]] void refuse(const std::string& why, const std::string& remedy) {
  throw sim::Error(sim::ErrorKind::kScene, {kOwner, "", why, remedy});
}

// A force on each particle by itself: f = -dU/dx, or as it is written.
class OfParticles final : public sim::Force {
 public:
  explicit OfParticles(const sim::Params& params) {
    const bool energy = params.has("energy");
    std::vector<std::string> inputs = {"x", "y", "z", "t", "m", "vx", "vy", "vz"};
    if (energy) inputs.resize(5);
    Formulas formulas(kOwner, params, inputs);
    sim::Graph& graph = formulas.graph;
    int u = -1, f[3];
    if (energy) u = formulas.read("energy", "a particle");
    for (int axis = 0; axis < 3; ++axis)
      f[axis] = energy ? graph.make(sim::Op::kNegate, graph.derivative(u, axis))
                       : formulas.read(std::string("f") + "xyz"[axis], "a particle");
    formulas.check_all_read(kFormulas);

    std::vector<int> by_position, by_velocity;
    for (const int component : f)
      for (int axis = 0; axis < 3; ++axis) {
        by_position.push_back(graph.derivative(component, axis));
        if (!energy) by_velocity.push_back(graph.derivative(component, 5 + axis));
      }
    force_ = formulas.compile(f);
    by_position_ = formulas.compile(by_position);
    if (energy) {
      energy_ = formulas.compile({&u, 1});
    } else {
      by_velocity_ = formulas.compile(by_velocity);
      reads_velocity_ = force_.reads(5) || force_.reads(6) || force_.reads(7);
    }
    has_energy_ = energy;
  }

  void accumulate(const sim::ParticleView& view, sim::Tile tile,
                  sim::ForceSink sink) const override {
    evaluate(force_, view, tile, [&](int begin, int count, const Values& f) {
      double* const to[3] = {sink.x + begin, sink.y + begin, sink.z + begin};
      for (int axis = 0; axis < 3; ++axis)
        for (int lane = 0; lane < count; ++lane) to[axis][lane] += f[axis][lane];
    });
  }

  bool depends_on_velocity() const override { return reads_velocity_; }
  bool conservative() const override { return has_energy_ && !energy_.reads(3); }
  bool has_jacobian() const override { return true; }

  void jacobian(const sim::ParticleView& view, sim::BlockSink& sink) const override {
    const auto block = [](const Values& d, int lane) {
      Mat3 value;
      for (int i = 0; i < 9; ++i) value(i / 3, i % 3) = d[i][lane];
      return value;
    };
    evaluate(by_position_, view, {0, view.n}, [&](int begin, int count, const Values& d) {
      for (int lane = 0; lane < count; ++lane)
        sink.position(begin + lane, begin + lane, block(d, lane));
    });
    if (!reads_velocity_) return;
    evaluate(by_velocity_, view, {0, view.n}, [&](int begin, int count, const Values& d) {
      for (int lane = 0; lane < count; ++lane)
        sink.velocity(begin + lane, begin + lane, block(d, lane));
    });
  }

  double potential(const sim::ParticleView& view, sim::Tile tile) const override {
    double sum = 0;
    if (!has_energy_) return sum;
    evaluate(energy_, view, tile, [&](int begin, int count, const Values& u) {
      for (int lane = 0; lane < count; ++lane)
        if (view.free(begin + lane)) sum += u[0][lane];
    });
    return sum;
  }

 private:
  using Values = double[9][kBlock];

  // Calls visit(begin, count, values) for the particles of a tile, block by block.
  template <class Visit>
  static void evaluate(const Program& program, const sim::ParticleView& view, sim::Tile tile,
                       const Visit& visit) {
    alignas(64) double values[9][kBlock], t[kBlock], m[kBlock];
    double* outputs[9];
    for (int i = 0; i < 9; ++i) outputs[i] = values[i];
    std::fill(t, t + kBlock, view.t);
    for (int begin = tile.begin; begin < tile.end; begin += program.block()) {
      const int count = std::min(program.block(), tile.end - begin);
      for (int lane = 0; lane < kBlock; ++lane)
        m[lane] = lane < count ? view.free_mass(begin + lane) : 0;
      const double* const inputs[] = {view.x + begin,  view.y + begin,  view.z + begin, t, m,
                                      view.vx + begin, view.vy + begin, view.vz + begin};
      program.run(inputs, outputs, count);
      visit(begin, count, values);
    }
  }

  Program force_, by_position_, by_velocity_, energy_;
  bool has_energy_ = false, reads_velocity_ = false;
};

// A force along each tie, f_a = -U'(r) d/r with d = x_a - x_b, r = |d|. Each tie is evaluated once,
// before the tiles; then every particle adds up what its ties give it.
class OfTies final : public sim::Force {
 public:
  OfTies(const sim::Params& params, const sim::Elements& ties) {
    if (!params.has("energy"))
      refuse("fx, fy and fz do not go with ties", "give the energy of a tie as a formula of r");
    std::vector<std::string> known = {"r", "t"}, own;
    rest_ = !params.has("rest");
    if (rest_) known.emplace_back("rest");
    for (const auto& [name, column] : ties.values)
      if (name != "rest" || !rest_) own.push_back(name);
    if (own.size() > kMostOwn)
      refuse("its ties give more than 8 numbers each", "give some to the force");
    Formulas formulas(kOwner, params, known, own);
    law_.emplace(formulas, "a tie", kFormulas);
    take(params, ties, own);
  }

  void bind(const sim::ParticleView& initial) override {
    places_ = sim::Incidence(initial.n, ends_);
    forces_ = sim::Array(4 * count());
    for (std::size_t tie = 0; rest_ && tie < count(); ++tie)
      if (double& rest = own_.front()[tie]; std::isnan(rest))
        rest = sim::length(difference(initial, static_cast<int>(tie)));
  }

  void prepare(const sim::ParticleView& view, sim::Team& team) override {
    team.run_parts(static_cast<int>(count()), kBlock, [&](int begin, int end) {
      const auto tie_of = [begin](int i) { return begin + i; };
      evaluate(law_->slope, view, end - begin, tie_of,
               [&](int first, int many, const Distances& at, const Values& values) {
                 double* to = forces_.data() + 4 * (begin + first);
                 for (int lane = 0; lane < many; ++lane, to += 4) {
                   const double s = -at.factor(lane, values[0][lane]);
                   for (int axis = 0; axis < 3; ++axis) to[axis] = s * at.d[axis][lane];
                 }
               });
    });
  }

  void accumulate(const sim::ParticleView&, sim::Tile tile, sim::ForceSink sink) const override {
    for (int i = tile.begin; i < tile.end; ++i) {
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

  void jacobian(const sim::ParticleView& view, sim::BlockSink& sink) const override {
    evaluate(
        law_->slopes, view, static_cast<int>(count()), [](int i) { return i; },
        [&](int first, int many, const Distances& at, const Values& values) {
          for (int lane = 0; lane < many; ++lane) {
            const int* const end = ends_.data() + 2 * (first + lane);
            const Mat3 k = at.curvature(lane, values[0][lane], values[1][lane]);
            sink.position(end[0], end[0], -k);
            sink.position(end[1], end[1], -k);
            sink.position(end[0], end[1], k);
            sink.position(end[1], end[0], k);
          }
        });
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
    for (int i = tile.begin; i < tile.end; ++i)
      for (const int place : places_.at(i)) {
        if (place % 2) continue;
        ties[many++] = place / 2;
        if (many == kBlock) add();
      }
    add();
    return sum;
  }

 private:
  using Values = double[2][kBlock];
  static constexpr std::size_t kMostOwn = 8;

  std::size_t count() const { return ends_.size() / 2; }

  Vec3 difference(const sim::ParticleView& view, int tie) const {
    const int* const end = ends_.data() + 2 * tie;
    return view.position(end[0]) - view.position(end[1]);
  }

  // The ties and the values of their variables. A `rest` that the scene does not give is the length
  // in the grid, or nan until bind() measures it.
  void take(const sim::Params& params, const sim::Elements& ties,
            const std::vector<std::string>& own) {
    ties.for_each([&](const sim::Element& tie) {
      ends_.insert(ends_.end(), tie.ids.begin(), tie.ids.end());
    });
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
    alignas(64) double values[2][kBlock], t[kBlock], own[kMostOwn + 1][kBlock];
    std::fill(t, t + kBlock, view.t);
    const double* inputs[kMostOwn + 3] = {at.r, t};
    for (std::size_t i = 0; i < own_.size(); ++i) inputs[i + 2] = own[i];
    double* const outputs[] = {values[0], values[1]};
    for (int first = 0; first < all; first += program.block()) {
      const int many = std::min(program.block(), all - first);
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
  bool rest_ = false;      // the first of them is `rest`, measured where it is not given
  sim::Incidence places_;  // in ends_, of each particle
  sim::Array forces_;      // N, on the first end of each tie; four numbers each
};

// A force between any two particles closer than the cutoff, f_i = -U'(r) d/r with d = x_i - x_j.
// Each pair is evaluated from both its ends, which gives exactly opposite forces.
class OfPairs final : public sim::Force {
 public:
  explicit OfPairs(const sim::Params& params)
      : cutoff_(params.number("cutoff")),
        neighbours_(cutoff_, params.has("skin") ? params.number("skin") : 0.2 * cutoff_) {
    if (!params.has("energy"))
      refuse("fx, fy and fz do not go with pairs", "give the energy of a pair as a formula of r");
    if (!(cutoff_ > 0)) refuse("its cutoff is 0", "give cutoff > 0 in m");
    Formulas formulas(kOwner, params, {"r", "t"});
    law_.emplace(formulas, "a pair", kFormulas);
  }

  // Finds out here whether the lists fit into memory.
  void bind(const sim::ParticleView& initial) override {
    sim::Team alone(1);
    neighbours_.update(initial, alone);
    forces_.resize(static_cast<std::size_t>(initial.n));
  }

  void prepare(const sim::ParticleView& view, sim::Team& team) override {
    const bool moved = neighbours_.update(view, team);
    if (!moved && known_ && conservative()) return;
    known_ = true;
    team.run_parts(view.n, 8, [&](int begin, int end) {
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
  void jacobian(const sim::ParticleView& view, sim::BlockSink& sink) const override {
    evaluate(law_->slopes, view, {0, view.n}, kAll,
             [&](int i, int j, int lane, const Distances& at, const Values& values) {
               const Mat3 k = at.curvature(lane, values[0][lane], values[1][lane]);
               sink.position(i, i, -k);
               sink.position(i, j, k);
             });
  }

  double potential(const sim::ParticleView& view, sim::Tile tile) const override {
    double sum = 0;
    evaluate(law_->energy, view, tile, kUpwards,
             [&](int, int, int lane, const Distances&, const Values& u) { sum += u[0][lane]; });
    return sum;
  }

 private:
  using Values = double[2][kBlock];
  enum Which { kAll, kUpwards };  // neighbours of a particle: those with a higher id

  // Calls visit(i, j, lane, distances, values) for the neighbours j of each particle i of a tile,
  // both ascending.
  template <class Visit>
  void evaluate(const Program& program, const sim::ParticleView& view, sim::Tile tile, Which which,
                const Visit& visit) const {
    Distances at;
    alignas(64) double values[2][kBlock], t[kBlock];
    std::fill(t, t + kBlock, view.t);
    const double* const inputs[] = {at.r, t};
    double* const outputs[] = {values[0], values[1]};
    int ends[kBlock][2], many = 0;
    const auto flush = [&] {
      at.measure(many);
      program.run(inputs, outputs, many);
      for (int lane = 0; lane < many; ++lane)
        if (at.r[lane] < cutoff_) visit(ends[lane][0], ends[lane][1], lane, at, values);
      many = 0;
    };
    for (int i = tile.begin; i < tile.end; ++i)
      neighbours_.for_each(i, [&](int j) {
        if (which == kUpwards && j < i) return;
        ends[many][0] = i;
        ends[many][1] = j;
        at.take(many++, view.position(i) - view.position(j));
        if (many == program.block()) flush();
      });
    if (many > 0) flush();
  }

  double cutoff_;
  sim::Neighbours neighbours_;
  std::optional<sim::RadialEnergy> law_;
  std::vector<Vec3> forces_;
  bool known_ = false;  // the forces, at the positions of the lists
};

std::unique_ptr<sim::Force> make_expression(const sim::Params& params, const sim::Elements& ties) {
  const bool energy = params.has("energy");
  const bool force = params.has("fx") || params.has("fy") || params.has("fz");
  if (energy == force)
    refuse(energy ? "it has an energy and a force" : "it has no formula",
           "give energy = \"0.5*k*(x^2 + y^2)\", or fx, fy and fz");
  if (params.has("cutoff")) {
    if (!ties.empty()) refuse("it has ties and a cutoff", "leave the cutoff out, or the ties");
    return std::make_unique<OfPairs>(params);
  }
  if (params.has("skin")) refuse("it has a skin, but no cutoff", "give the cutoff of its pairs");
  if (ties.empty()) return std::make_unique<OfParticles>(params);
  return std::make_unique<OfTies>(params, ties);
}

}  // namespace

SIM_PLUGIN(Force, "expression") {
  using sim::ParamType;
  registrar.add(sim::ForcePlugin{
      {.name = "expression",
       .summary = "a force as a formula: of each particle, of the length of ties, of all pairs",
       .formula =
           "f = -dU/dx,  U = energy; of ties f_a = -U'(r) (x_a - x_b)/r;  or f = (fx, fy, fz)\n"
           "of a particle: x y z t m, and vx vy vz in fx fy fz;  of a tie: r t rest\n"
           "with a cutoff, of every pair of particles closer than that: r t\n"
           "rest: the distance in the grid or at the start;  m: 0 of a pinned particle\n"
           "^ * / + - ( );  sqrt exp log sin cos tan sinh cosh tanh abs sign step floor\n"
           "min max pow select(c, a, b);  pi;  \"s^12 - s^6; s = sigma/r\"\n"
           "other names are numbers given to the force, k = 100; ties may give numbers of their "
           "own",
       .params =
           {{.name = "energy",
             .type = ParamType::kText,
             .unit = "J",
             .doc = "potential energy of a particle, of a tie, or of a pair",
             .positional = true},
            {.name = "fx",
             .type = ParamType::kText,
             .unit = "N",
             .doc = "instead of energy: the force along x on each particle; if not given, 0"},
            {.name = "fy", .type = ParamType::kText, .unit = "N", .doc = "likewise, along y"},
            {.name = "fz", .type = ParamType::kText, .unit = "N", .doc = "likewise, along z"},
            {.name = "cutoff",
             .unit = "m",
             .doc = "reach of the pairs; the energy is not shifted, so let it end smoothly there",
             .min = 0},
            {.name = "skin",
             .unit = "m",
             .doc = "how much further the lists of neighbours reach, for speed alone; if not "
                    "given, a fifth of the cutoff",
             .min = 0}},
       .elements = sim::ElementKind{.arity = 2},
       .pointwise = true,
       .free_numbers = true,
       .example = {{"energy", std::string("0.5*k*(r - rest)^2")}, {"k", 20.0}}},
      make_expression});
}
