// Forces given as formulas: of ties, of pairs, of each particle by itself, differentiated and
// compiled.
#include <algorithm>

#include "core/expression/formulas.h"
#include "parts.h"

namespace {

using namespace sim::expression;
using sim::Formulas;
using sim::Mat3;
using sim::Program;

// A force on each particle by itself: f = -dU/dx, or as given.
class OfParticles final : public sim::Force {
 public:
  OfParticles(const sim::Params& params, Carried carried) {
    check_carried(carried);
    const bool energy = params.has("energy");
    std::vector<std::string> inputs = {"x", "y", "z", "t", "m"};
    if (!energy) inputs.insert(inputs.end(), {"vx", "vy", "vz"});
    own_from_ = static_cast<int>(inputs.size());
    carried.erase("m");  // a variable already, which is 0 of a pinned particle
    for (auto& [name, values] : carried) {
      inputs.push_back(name);
      values.resize((values.size() + 7) / 8 * 8);
      own_.push_back(std::move(values));
    }
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

  void jacobian(const sim::ParticleView& view, sim::JacobianSink& sink) const override {
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

  bool couplings(std::vector<std::array<int, 2>>& /*pairs*/) const override { return true; }

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
  void evaluate(const Program& program, const sim::ParticleView& view, sim::Tile tile,
                const Visit& visit) const {
    const double* inputs[kMostKnown + kMostCarried];
    alignas(64) double values[9][kBlock], t[kBlock], m[kBlock];
    double* outputs[9];
    for (int i = 0; i < 9; ++i) outputs[i] = values[i];
    std::fill(t, t + kBlock, view.t);
    for (int begin = tile.begin; begin < tile.end; begin += kBlock) {
      const int count = std::min(kBlock, tile.end - begin);
      for (int lane = 0; lane < kBlock; ++lane)
        m[lane] = lane < count ? view.free_mass(begin + lane) : 0;
      const double* const known[] = {view.x + begin,  view.y + begin,  view.z + begin, t, m,
                                     view.vx + begin, view.vy + begin, view.vz + begin};
      std::copy_n(known, own_from_, inputs);
      for (std::size_t k = 0; k < own_.size(); ++k)
        inputs[static_cast<std::size_t>(own_from_) + k] = own_[k].data() + begin;
      program.run(inputs, outputs, count);
      visit(begin, count, values);
    }
  }

  Program force_, by_position_, by_velocity_, energy_;
  bool has_energy_ = false, reads_velocity_ = false;
  static constexpr int kMostKnown = 8;
  int own_from_ = 0;                      // variables before those carried by particles
  std::vector<std::vector<double>> own_;  // of all particles, in whole vectors
};

// True if the energy can be read as that of a pair: it names r without defining it.
bool reads_distance(const sim::Params& params, const Carried& carried) {
  std::vector<std::string> inputs = {"r", "t"};
  const OfBoth both(carried);
  inputs.insert(inputs.end(), both.names().begin(), both.names().end());
  sim::Names names{inputs, params.free_numbers(), {}};
  sim::Graph graph;
  try {
    if (params.free_numbers().contains("r")) return false;
    sim::parse(params.text("energy"), "", names, graph);
  } catch (const sim::Error&) {
    // An error is reported by the reader of the formula: as that of a pair if r was read by then.
  }
  return names.used.contains("r");
}

std::unique_ptr<sim::Force> make_expression(const sim::Params& params, const sim::Elements& ties) {
  const bool energy = params.has("energy");
  const bool force = params.has("fx") || params.has("fy") || params.has("fz");
  if (energy == force)
    refuse(energy ? "it has an energy and a force" : "it has no formula",
           "give energy = \"0.5*k*(x^2 + y^2)\", or fx, fy and fz");
  if (params.has("cutoff")) {
    if (!ties.empty()) refuse("it has ties and a cutoff", "leave the cutoff out, or the ties");
    return make_of_pairs(params, ties.carried);
  }
  if (params.has("skin")) refuse("it has a skin, but no cutoff", "give the cutoff of its pairs");
  if (!ties.empty()) return make_of_ties(params, ties);
  if (energy && reads_distance(params, ties.carried)) return make_of_pairs(params, ties.carried);
  return std::make_unique<OfParticles>(params, ties.carried);
}

}  // namespace

SIM_PLUGIN(Force, "expression") {
  using sim::ParamType;
  registrar.add(sim::ForcePlugin{
      {.name = "expression",
       .summary = "a force as a formula: of each particle, of the length of ties, of all pairs",
       .formula =
           "f = -dU/dx,  U = energy; of ties f_a = -U'(r) (x_a - x_b)/r;  or f = (fx, fy, fz)\n"
           "of a particle: x y z t m, and vx vy vz in fx fy fz;  of a tie: r t rest m1 m2\n"
           "without ties, of every pair of particles if it reads r: r t m1 m2;  with a cutoff, of "
           "those closer than that\n"
           "what particles carry: charge of one, charge1 charge2 of the two of a tie or pair\n"
           "rest: the distance in the grid or at the start;  m: 0 of a pinned particle;  m1 m2: "
           "the masses, pinned or not, 1 of the lower id in a pair\n"
           "^ * / + - ( );  < <= > >= give 1 where true, else 0;  sqrt exp log sin cos tan sinh\n"
           "cosh tanh abs sign step floor min max pow;  if(c, a, b) or select(c, a, b): a where c "
           "is not 0, else b\n"
           "pi;  \"s^12 - s^6; s = sigma/r\"\n"
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
            {.name = "break_strain",
             .doc = "of ties: r / rest - 1 beyond which one breaks at the end of a step; if not "
                    "given, none does",
             .per_tie = true,
             .min = 0},
            {.name = "break_force",
             .unit = "N",
             .doc = "of ties: likewise dU/dr",
             .per_tie = true,
             .min = 0},
            {.name = "skin",
             .unit = "m",
             .doc = "how much further the lists of neighbours reach, for speed alone; if not "
                    "given, a fifth of the cutoff",
             .min = 0}},
       .elements = sim::ElementKind{.arity = 2},
       .pointwise = true,
       .free_numbers = true,
       .reads_particles = true,
       .example = {{"energy", std::string("0.5*k*(r - rest)^2")}, {"k", 20.0}}},
      make_expression});
}
