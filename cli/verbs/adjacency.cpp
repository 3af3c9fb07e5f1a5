#include "cli/verbs/adjacency.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/base/text.h"
#include "core/ode/stability.h"
#include "core/output/format.h"
#include "core/study/limits/spectrum.h"

namespace sim::cli {
namespace {

bool chosen(const Simulation& system, const ParticleChoice& choice) {
  return system.second_order() && (choice.system.empty() || choice.system == system.name()) &&
         choice.id >= 0 && choice.id < system.particles();
}

// By family in the order of the scene, then by neighbour.
std::vector<Link> sorted_links(const Simulation& system, int particle) {
  std::vector<std::string> order;
  for (const auto& [family, count] : system.families()) order.push_back(family);
  std::vector<Link> links = system.links(particle);
  const auto rank = [&](const Link& link) {
    return std::find(order.begin(), order.end(), link.family) - order.begin();
  };
  std::stable_sort(links.begin(), links.end(), [&](const Link& a, const Link& b) {
    return rank(a) != rank(b) ? rank(a) < rank(b) : a.to < b.to;
  });
  return links;
}

// One row of the table: springs of a family that look the same, and where they lead.
struct SpringRow {
  std::string family, stiffness, rest, neighbours;
};

std::vector<SpringRow> table(const std::vector<Link>& links) {
  std::vector<SpringRow> rows;
  for (const Link& link : links) {
    const SpringRow key{link.family, brief(link.stiffness), brief(link.rest), {}};
    auto row = std::find_if(rows.begin(), rows.end(), [&](const SpringRow& other) {
      return other.family == key.family && other.stiffness == key.stiffness &&
             other.rest == key.rest;
    });
    if (row == rows.end()) row = rows.insert(rows.end(), key);
    row->neighbours += (row->neighbours.empty() ? "" : " ") + std::to_string(link.to);
  }
  return rows;
}

void print_text(const Simulation& system, const SystemSpec& spec, int particle, std::ostream& out) {
  const std::vector<Link> links = sorted_links(system, particle);
  out << "scene " << system.name() << "  " << counted(system.particles(), "particle") << "  "
      << counted(spring_count(system), "spring") << '\n';
  out << "particle " << particle;
  if (const GridSpec* const grid = spec.particles->grid_of(particle)) {
    const auto [i, j, k] = grid->at(particle);
    out << " (" << i << ',' << j;
    if (grid->directions == 3) out << ',' << k;
    out << ')';
  }
  out << "  " << counted(static_cast<long>(links.size()), "spring") << '\n';

  const std::vector<SpringRow> rows = table(links);
  std::size_t family = 0, stiffness = 0, rest = 0;
  for (const SpringRow& row : rows) {
    family = std::max(family, row.family.size());
    stiffness = std::max(stiffness, row.stiffness.size());
    rest = std::max(rest, row.rest.size());
  }
  for (const SpringRow& row : rows)
    out << left(row.family, family) << "  k " << right(row.stiffness, stiffness) << " N/m  rest "
        << left(row.rest, rest) << " m  " << row.neighbours << '\n';
}

// A spring in the present state.
struct SpringState {
  double length = 0, strain = 0, force = 0;  // m, length / rest - 1, N
  double dt_limit = 0;                       // s; 0: no step is stable, infinity: any is
};

// The two ends alone vibrate with omega^2 = k (1/m_i + 1/m_j), where a pinned end counts nothing.
SpringState state_of(Simulation& system, int particle, const Link& link) {
  SpringState state;
  state.length = (system.position(particle) - system.position(link.to)).stableNorm();
  state.strain = state.length / link.rest - 1;
  state.force = link.tension(state.length);
  const double inverse_mass =
      study::inverse_mass(system, particle) + study::inverse_mass(system, link.to);
  state.dt_limit = stable_step(system.integrator(), std::sqrt(link.stiffness * inverse_mass),
                               study::smallest_damping(system));
  return state;
}

std::string json_text(const Simulation& system, int particle, bool world) {
  std::vector<std::string> springs;
  for (const Link& link : sorted_links(system, particle)) {
    const double length = (system.position(particle) - system.position(link.to)).stableNorm();
    springs.push_back(JsonObject()
                          .text("family", link.family)
                          .integer("to", link.to)
                          .number("stiffness", link.stiffness)
                          .number("rest", link.rest)
                          .number("length", length)
                          .number("force", link.tension(length))
                          .str());
  }
  JsonObject object;
  if (world) object.text("system", system.name());
  return object.integer("particle", particle).json("springs", json_array(springs)).str();
}

}  // namespace

void check_particle(const LoadedScene& scene, const ParticleChoice& choice) {
  const auto fail = [&](const std::string& why, const std::string& remedy) {
    throw Error(ErrorKind::kUsage,
                {"no such particle",
                 (choice.system.empty() ? "" : choice.system + ":") + std::to_string(choice.id),
                 why, remedy});
  };
  if (!scene.has_second_order())
    fail("a first-order scene has no springs", "choose a scene with particles and forces");
  int most = 0;
  bool known = choice.system.empty();
  for (const Simulation& system : scene.systems) {
    if (!choice.system.empty() && choice.system != system.name()) continue;
    known = true;
    if (!system.second_order() && !choice.system.empty())
      fail("system '" + choice.system + "' is first-order and has no springs",
           "choose a system with particles and forces");
    if (chosen(system, choice)) return;
    if (system.second_order()) most = std::max(most, system.particles());
  }
  if (!known) fail("the scene has no such system", suggestion(choice.system, scene.names()));
  fail("there are " + counted(most, "particle"), "ids run from 0 to " + std::to_string(most - 1));
}

void print_adjacency(const LoadedScene& scene, const ParticleChoice& choice, bool json,
                     std::ostream& out) {
  for (std::size_t i = 0; i < scene.systems.size(); ++i) {
    const Simulation& system = scene.systems[i];
    if (!chosen(system, choice)) continue;
    const int particle = static_cast<int>(choice.id);
    if (json) {
      out << json_text(system, particle, scene.spec.world) << '\n';
    } else {
      print_text(system, scene.spec.systems[i], particle, out);
    }
  }
}

void print_spring_states(LoadedScene& scene, const ParticleChoice& choice, std::ostream& out) {
  constexpr std::size_t kNumber = 14;
  for (Simulation& system : scene.systems) {
    if (!chosen(system, choice)) continue;
    const int particle = static_cast<int>(choice.id);
    out << "particle " << particle << " at t = " << brief(system.t()) << " s\n"
        << right("to", 7) << "  " << left("family", 12) << right("length [m]", kNumber)
        << right("strain", kNumber) << right("force [N]", kNumber)
        << right("stable dt [s]", kNumber) << '\n';
    for (const Link& link : sorted_links(system, particle)) {
      const SpringState state = state_of(system, particle, link);
      const std::string limit = std::isnan(state.dt_limit)   ? "-"
                                : std::isinf(state.dt_limit) ? "any"
                                                             : brief(state.dt_limit, 4);
      out << right(std::to_string(link.to), 7) << "  " << left(link.family, 12)
          << right(brief(state.length), kNumber) << right(percent(state.strain), kNumber)
          << right(brief(state.force, 4), kNumber) << right(limit, kNumber) << '\n';
    }
  }
}

int adjacency(const AdjacencyRequest& request, const Environment& environment, Registry& registry,
              Console& console) {
  const LoadedScene scene = load(request.scene, environment, registry);
  check_particle(scene, request.particle);
  print_adjacency(scene, request.particle, request.json, console.out);
  flush_or_throw(console.out, "standard output");
  return 0;
}

}  // namespace sim::cli
