// Forces as formulas: of ties, of each particle by itself, differentiated and compiled.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/base/array.h"
#include "core/base/team.h"
#include "core/base/text.h"
#include "core/expression/parse.h"
#include "core/expression/program.h"
#include "core/particles/springs/springs.h"
#include "core/plugin/plugin.h"

namespace {

using sim::Graph;
using sim::Mat3;
using sim::Op;
using sim::Program;
using sim::Vec3;

constexpr int kBlock = Program::kBlock;

[[noreturn]] void refuse(const std::string& why, const std::string& remedy) {
  throw sim::Error(sim::ErrorKind::kScene, {"force 'expression'", "", why, remedy});
}

// Reads the formulas of one force. Its variables are what it knows itself, then names whose values
// the scene gives one by one; other names are numbers that the scene gives to the force.
class Formulas {
 public:
  Formulas(const sim::Params& params, const std::vector<std::string>& known,
           const std::vector<std::string>& own = {})
      : params_(params), names_{known, params.free_numbers(), {}}, given_(own) {
    names_.inputs.insert(names_.inputs.end(), own.begin(), own.end());
    for (const std::string& name : own) names_.numbers.erase(name);
    for (const auto& entry : names_.numbers) given_.push_back(entry.first);
    for (const std::string& name : given_)
      if (std::ranges::count(known, name))
        refuse("'" + name + "' is a variable of it already", "give the number another name");
  }

  // The formula of a parameter, 0 for one that is not given.
  int read(const std::string& param, const std::string& of) {
    if (!params_.has(param)) return graph.number(0);
    return sim::parse(params_.text(param), "bad " + param + " of " + of, names_, graph);
  }

  // Throws for a name that the scene gives and no formula reads.
  void check_all_read() const {
    std::vector<std::string> known(names_.used.begin(), names_.used.end());
    for (const char* param : {"energy", "fx", "fy", "fz"}) known.emplace_back(param);
    for (const std::string& name : given_)
      if (!names_.used.contains(name)) {
        const std::string near = sim::nearest(name, known);
        refuse("no formula of it reads '" + name + "'",
               near.empty() ? "leave it out" : "did you mean '" + near + "'?");
      }
  }

  Program compile(std::span<const int> outputs) const {
    return Program(graph, outputs, static_cast<int>(names_.inputs.size()));
  }

  Graph graph;

 private:
  const sim::Params& params_;
  sim::Names names_;
  std::vector<std::string> given_;
};

// A force on each particle by itself: f = -dU/dx, or as it is written.
class OfParticles final : public sim::Force {
 public:
  explicit OfParticles(const sim::Params& params) {
    const bool energy = params.has("energy");
    std::vector<std::string> inputs = {"x", "y", "z", "t", "m", "vx", "vy", "vz"};
    if (energy) inputs.resize(5);
    Formulas formulas(params, inputs);
    Graph& graph = formulas.graph;
    int u = -1, f[3];
    if (energy) u = formulas.read("energy", "a particle");
    for (int axis = 0; axis < 3; ++axis)
      f[axis] = energy ? graph.make(Op::kNegate, graph.derivative(u, axis))
                       : formulas.read(std::string("f") + "xyz"[axis], "a particle");
    formulas.check_all_read();

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

// The distances of a block of pairs.
struct Distances {
  alignas(64) double d[3][kBlock], r[kBlock];

  void take(int lane, const Vec3& difference) {
    for (int axis = 0; axis < 3; ++axis) d[axis][lane] = difference[axis];
  }
  Vec3 at(int lane) const { return {d[0][lane], d[1][lane], d[2][lane]}; }

  void measure(int count) {
    const int lanes = (count + 7) / 8 * 8;
    for (int lane = count; lane < lanes; ++lane) take(lane, Vec3(1, 0, 0));
    double least = 1, most = 1;
    for (int lane = 0; lane < lanes; ++lane) {
      const double square =
          d[0][lane] * d[0][lane] + d[1][lane] * d[1][lane] + d[2][lane] * d[2][lane];
      least = square < least ? square : least;
      most = square > most ? square : most;
      r[lane] = std::sqrt(square);
    }
    if (least > sim::kSafeLeast && most < sim::kSafeMost) return;
    for (int lane = 0; lane < lanes; ++lane) r[lane] = sim::length(at(lane));
  }

  // U'(r) / r, but 0 where there is no direction and U' is finite.
  double factor(int lane, double slope) const { return r[lane] > 0 ? slope / r[lane] : 0 * slope; }

  // d^2 U / dx dx = U'' u u^T + U'/r (1 - u u^T) with u = d/r; U'' in all directions for r = 0.
  Mat3 curvature(int lane, double slope, double second) const {
    if (r[lane] == 0) return second * Mat3::Identity();
    const Vec3 u = at(lane) / r[lane];
    const double across = slope / r[lane];
    return across * Mat3::Identity() + (second - across) * outer(u, u);
  }
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
      refuse("its ties give more than " + std::to_string(kMostOwn) + " numbers each",
             "give some to the force");
    Formulas formulas(params, known, own);
    Graph& graph = formulas.graph;
    const int u = formulas.read("energy", "a tie"), slope = graph.derivative(u, 0);
    formulas.check_all_read();
    const int slopes[] = {slope, graph.derivative(slope, 0)};
    energy_ = formulas.compile({&u, 1});
    slope_ = formulas.compile({slopes, 1});
    slopes_ = formulas.compile(slopes);
    take(params, ties, own);
  }

  void bind(const sim::ParticleView& initial) override {
    first_.assign(static_cast<std::size_t>(initial.n) + 1, 0);
    places_.resize(ends_.size());
    for (const int end : ends_) ++first_[static_cast<std::size_t>(end) + 1];
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    std::vector<int> next = first_;
    for (std::size_t place = 0; place < ends_.size(); ++place)
      places_[static_cast<std::size_t>(next[static_cast<std::size_t>(ends_[place])]++)] =
          static_cast<int>(place);
    forces_ = sim::Array(4 * count());
    for (std::size_t tie = 0; rest_ && tie < count(); ++tie)
      if (double& rest = own_.front()[tie]; std::isnan(rest))
        rest = sim::length(difference(initial, static_cast<int>(tie)));
  }

  void prepare(const sim::ParticleView& view, sim::Team& team) override {
    team.run_parts(static_cast<int>(count()), kBlock, [&](int begin, int end) {
      const auto tie_of = [begin](int i) { return begin + i; };
      evaluate(slope_, view, end - begin, tie_of,
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
      for (const int place : places_of(i)) {
        const double* const f = forces_.data() + 4 * (place / 2);
        const double sign = 1 - 2 * (place % 2);
        for (int axis = 0; axis < 4; ++axis) sum[axis] += sign * f[axis];
      }
      sink.add(i, {sum[0], sum[1], sum[2]});
    }
  }

  bool depends_on_velocity() const override { return false; }
  bool has_jacobian() const override { return true; }

  void jacobian(const sim::ParticleView& view, sim::BlockSink& sink) const override {
    evaluate(
        slopes_, view, static_cast<int>(count()), [](int i) { return i; },
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
          energy_, view, many, [&](int i) { return ties[i]; },
          [&](int, int some, const Distances&, const Values& values) {
            for (int lane = 0; lane < some; ++lane) sum += values[0][lane];
          });
      many = 0;
    };
    for (int i = tile.begin; i < tile.end; ++i)
      for (const int place : places_of(i)) {
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

  std::span<const int> places_of(int i) const {
    const auto begin = static_cast<std::size_t>(first_[static_cast<std::size_t>(i)]);
    const auto end = static_cast<std::size_t>(first_[static_cast<std::size_t>(i) + 1]);
    return {places_.data() + begin, end - begin};
  }

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

  Program energy_, slope_, slopes_;
  std::vector<int> ends_;                 // two a tie
  std::vector<std::vector<double>> own_;  // a variable, of each tie
  bool rest_ = false;                // the first of them is `rest`, measured where it is not given
  std::vector<int> first_, places_;  // those of i in ends_: [first_[i], first_[i + 1])
  sim::Array forces_;                // N, on the first end of each tie; four numbers each
};

std::unique_ptr<sim::Force> make_expression(const sim::Params& params, const sim::Elements& ties) {
  const bool energy = params.has("energy");
  const bool force = params.has("fx") || params.has("fy") || params.has("fz");
  if (energy == force)
    refuse(energy ? "it has an energy and a force" : "it has no formula",
           "give energy = \"0.5*k*(x^2 + y^2)\", or fx, fy and fz");
  if (ties.empty()) return std::make_unique<OfParticles>(params);
  return std::make_unique<OfTies>(params, ties);
}

}  // namespace

SIM_PLUGIN(Force, "expression") {
  using sim::ParamType;
  registrar.add(sim::ForcePlugin{
      {.name = "expression",
       .summary = "a force as a formula: of each particle, or of the length of its ties",
       .formula =
           "f = -dU/dx,  U = energy; of ties f_a = -U'(r) (x_a - x_b)/r;  or f = (fx, fy, fz)\n"
           "of a particle: x y z t m, and vx vy vz in fx fy fz;  of a tie: r t rest\n"
           "rest: the distance in the grid or at the start;  m: 0 of a pinned particle\n"
           "^ * / + - ( );  sqrt exp log sin cos tan sinh cosh tanh abs sign step floor\n"
           "min max pow select(c, a, b);  pi;  \"s^12 - s^6; s = sigma/r\"\n"
           "other names are numbers given to the force, k = 100; ties may give numbers of their "
           "own",
       .params =
           {{.name = "energy",
             .type = ParamType::kText,
             .unit = "J",
             .doc = "potential energy of a particle, or of a tie",
             .positional = true},
            {.name = "fx",
             .type = ParamType::kText,
             .unit = "N",
             .doc = "instead of energy: the force along x on each particle; if not given, 0"},
            {.name = "fy", .type = ParamType::kText, .unit = "N", .doc = "likewise, along y"},
            {.name = "fz", .type = ParamType::kText, .unit = "N", .doc = "likewise, along z"}},
       .elements = {.arity = 2},
       .pointwise = true,
       .free_numbers = true,
       .example = {{"energy", std::string("0.5*k*(r - rest)^2")}, {"k", 20.0}}},
      make_expression});
}
