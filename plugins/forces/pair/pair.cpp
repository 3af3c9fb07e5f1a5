// Pair potentials with a cutoff between all particles.
#include <algorithm>

#include "core/plugin/plugin.h"
#include "pair_forces.h"

namespace {

using sim::PairLaw;

// The names of the parameters of each potential.
struct Choice {
  const char* name;
  PairLaw::Kind kind;
  const char *strength, *length;
  const char* rate;  // nullptr: none
  bool cuts;         // takes cutoff and smooth
};
constexpr Choice kChoices[] = {
    {"lennard_jones", PairLaw::Kind::kLennardJones, "epsilon", "sigma", nullptr, true},
    {"soft", PairLaw::Kind::kSoft, "k", "radius", nullptr, false},
    {"morse", PairLaw::Kind::kMorse, "depth", "r0", "a", true}};

[[noreturn]] void refuse(const std::string& why, const std::string& remedy) {
  throw sim::Error(sim::ErrorKind::kScene, {"force 'pair'", "", why, remedy});
}

bool takes(const Choice& choice, const std::string& parameter) {
  for (const char* own : {choice.strength, choice.length, choice.rate})
    if (own && parameter == own) return true;
  return choice.cuts && (parameter == "cutoff" || parameter == "smooth");
}

// Refuses parameters of another potential.
void check(const Choice& choice, const sim::Params& params) {
  const std::string name = choice.name;
  for (const char* other :
       {"epsilon", "sigma", "k", "radius", "depth", "r0", "a", "cutoff", "smooth"}) {
    if (!params.has(other) || takes(choice, other)) continue;
    const std::string parameter = other;
    refuse("potential '" + name + "' takes no " + parameter,
           parameter == "cutoff" || parameter == "smooth"
               ? "leave " + parameter + " out: " + name + " ends at its radius"
               : "leave " + parameter + " out, or choose the potential it belongs to");
  }
}

// A parameter that is not given is 1 in its unit.
double number(const sim::Params& params, const char* name) {
  if (!params.has(name)) return 1;
  const double value = params.number(name);
  if (!(value > 0)) refuse(std::string(name) + " is 0", "give a positive number");
  return value;
}

class Pair final : public sim::Force {
 public:
  Pair(const PairLaw& law, double skin) : forces_(law, skin) {}

  // Checks here already that the neighbour lists fit into memory.
  void bind(const sim::ParticleView& initial) override {
    sim::ThreadPool alone(1);
    forces_.prepare(initial, alone);
  }
  void prepare(const sim::ParticleView& view, sim::ThreadPool& pool) override {
    forces_.prepare(view, pool);
  }
  void accumulate(const sim::ParticleView&, sim::Tile tile, sim::ForceSink sink) const override {
    forces_.add(tile, sink);
  }
  bool depends_on_velocity() const override { return false; }
  bool conservative() const override { return true; }
  double potential(const sim::ParticleView&, sim::Tile tile) const override {
    return forces_.potential(tile);
  }
  bool has_jacobian() const override { return true; }
  void jacobian(const sim::ParticleView& view, sim::JacobianSink& sink) const override {
    forces_.jacobian(view, sink);
  }

 private:
  sim::PairForces forces_;
};

std::unique_ptr<sim::Force> make_pair(const sim::Params& params) {
  const std::string& name = params.text("potential");
  const Choice& choice = *std::find_if(std::begin(kChoices), std::end(kChoices),
                                       [&](const Choice& c) { return name == c.name; });
  check(choice, params);
  PairLaw law{.kind = choice.kind,
              .strength = number(params, choice.strength),
              .length = number(params, choice.length),
              .rate = choice.rate ? number(params, choice.rate) : 0};
  const double reach = law.kind == PairLaw::Kind::kLennardJones ? 2.5 * law.length
                       : law.kind == PairLaw::Kind::kMorse      ? law.length + 6 / law.rate
                                                                : law.length;
  law.cutoff = params.has("cutoff") ? number(params, "cutoff") : reach;
  const std::string smooth = params.has("smooth") ? params.text("smooth") : "energy";
  if (choice.cuts && smooth != "off") law = sim::shifted(law, smooth == "force");
  return std::make_unique<Pair>(law, params.has("skin") ? params.number("skin") : 0.3 * law.length);
}

}  // namespace

SIM_PLUGIN(Force, "pair") {
  using sim::ParamType;
  registrar.add(sim::ForcePlugin{
      {.name = "pair",
       .summary = "a pair potential with a cutoff, between all particles",
       .formula = "f_i = -U'(r) d/r for r < cutoff,  d = x_i - x_j, r = |d|;  0 for r = 0\n"
                  "lennard_jones  U = 4 epsilon ((sigma/r)^12 - (sigma/r)^6)\n"
                  "soft           U = k/2 (radius - r)^2 for r < radius\n"
                  "morse          U = depth (e^2 - 2 e),  e = exp(-a (r - r0))\n"
                  "smooth         off: U as it is, so that energy jumps at the cutoff;\n"
                  "               energy: U(r) - U(cutoff);\n"
                  "               force: U(r) - U(cutoff) - (r - cutoff) U'(cutoff)",
       .source = "Jones (1924), Proc. R. Soc. A 106, 463-477; Morse (1929), Phys. Rev. 34, 57-64; "
                 "lists: Verlet (1967), Phys. Rev. 159, 98-103",
       .params =
           {{.name = "potential",
             .type = ParamType::kText,
             .default_value = std::string("lennard_jones"),
             .doc = "U; parameters of the others are refused, its own are 1 if not given",
             .positional = true,
             .choices = {"lennard_jones", "soft", "morse"}},
            {.name = "epsilon", .unit = "J", .doc = "depth of lennard_jones", .min = 0},
            {.name = "sigma", .unit = "m", .doc = "distance at which lennard_jones is 0", .min = 0},
            {.name = "k", .unit = "N/m", .doc = "stiffness of soft", .min = 0},
            {.name = "radius", .unit = "m", .doc = "reach of soft", .min = 0},
            {.name = "depth", .unit = "J", .doc = "depth of morse, at r0", .min = 0},
            {.name = "r0", .unit = "m", .doc = "distance of rest of morse", .min = 0},
            {.name = "a", .unit = "1/m", .doc = "how narrow the well of morse is", .min = 0},
            {.name = "cutoff",
             .unit = "m",
             .doc = "reach of lennard_jones and morse; if not given, 2.5 sigma and r0 + 6/a",
             .min = 0},
            {.name = "smooth",
             .type = ParamType::kText,
             .doc = "what is continuous at the cutoff; if not given, energy",
             .choices = {"off", "energy", "force"}},
            {.name = "skin",
             .unit = "m",
             .doc = "how much further the lists of neighbours reach, for speed alone; if not "
                    "given, 0.3 sigma, radius or r0",
             .min = 0}}},
      [](const sim::Params& params, const sim::Elements&) { return make_pair(params); }});
}
