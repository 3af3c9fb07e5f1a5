// Sheets that contact keeps apart, as scenes.
#pragma once

#include <catch2/catch.hpp>
#include <cmath>

#include "core/particles/step_correction.h"
#include "tests/support/all_intersections.h"
#include "tests/support/scenes.h"

namespace sim_test {

struct SheetOptions {
  int n = 12;
  double stiffness = 50;  // N/m, of structural springs; shear half of it, flex a tenth
  double friction = 0.3, thickness = 0;  // 0: a fifth of the spacing
  double flex = 0.1;
};

// Sheets of n x n particles and 1 m and 1 kg each, with places given by (sheet, u, v).
template <class SourceLocation>
sim::SystemSpec make_sheets(int sheets, const SheetOptions& options, const SourceLocation& place) {
  const int n = options.n;
  const double side = 1.0 / n, mass = 1.0 / (n * n);
  sim::SystemSpec spec;
  spec.name = "sheets";
  spec.integrator = "verlet";
  spec.duration = 1;
  spec.particles.emplace();
  std::vector<sim::PartSpec> springs{make_springs("structural", options.stiffness),
                                     make_springs("shear", 0.5 * options.stiffness),
                                     make_springs("flex", options.flex * options.stiffness)};
  const std::pair<int, int> offsets[] = {{0, 1}, {1, 0}, {1, 1}, {1, -1}, {0, 2}, {2, 0}};
  sim::ContactSpec contact{
      .given = {{"thickness", options.thickness > 0 ? options.thickness : 0.2 * side},
                {"friction", options.friction}}};
  for (int sheet = 0; sheet < sheets; ++sheet) {
    std::vector<sim::TriangleMesh::Triangle> triangles = sim::grid_triangles({n, n, 1}, false);
    for (auto& triangle : triangles)
      for (int& id : triangle) id += sheet * n * n;
    contact.surfaces.push_back(
        std::make_shared<const sim::TriangleMesh>(sheets * n * n, std::move(triangles)));
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        spec.particles->list.push_back(
            {.position = place(sheet, i * side, j * side), .mass = mass});
        for (int k = 0; k < 6; ++k) {
          const auto [di, dj] = offsets[k];
          if (i + di >= n || j + dj >= n || j + dj < 0) continue;
          const int at = (sheet * n + i) * n + j;
          springs[static_cast<std::size_t>(k / 2)].elements.add(
              {at, at + di * n + dj}, {{"rest", side * std::hypot(di, dj)}});
        }
      }
  }
  spec.forces = springs;
  spec.surfaces = contact.surfaces;
  spec.contact = contact;
  // omega^2 <= 8 sum k / m
  spec.dt = 0.5 / std::sqrt(options.stiffness * (1.5 + options.flex) / mass);
  return spec;
}

inline std::int64_t crossings(const sim::Simulation& system, const sim::SystemSpec& spec) {
  std::vector<sim::Vec3> places;
  for (int i = 0; i < system.particles(); ++i) places.push_back(system.position(i));
  std::vector<std::array<int, 3>> triangles;
  for (const auto& surface : spec.contact->surfaces)
    triangles.insert(triangles.end(), surface->triangles().begin(), surface->triangles().end());
  return sim_test::all_crossings(places, triangles);
}

inline sim::Vec3 momentum(const sim::Simulation& system, const sim::SystemSpec& spec) {
  sim::Vec3 sum = sim::Vec3::Zero();
  for (int i = 0; i < system.particles(); ++i)
    sum += spec.particles->at(i).mass * system.velocity(i);
  return sum;
}

// Each step of a run taken without contact, too, from the same state.
class WithoutContact {
 public:
  WithoutContact(const sim::SystemSpec& spec, sim::Registry& registry)
      : spec_(bare(spec)), system_(spec_, registry) {}

  bool step_from(const sim::Simulation& run) {
    system_.restore(run.snapshot());
    return system_.step();
  }
  sim::Simulation& system() { return system_; }
  double momentum_change(const sim::Simulation& run) const {  // kg m/s, by contact
    return (momentum(run, spec_) - momentum(system_, spec_)).norm();
  }

 private:
  static sim::SystemSpec bare(sim::SystemSpec spec) {
    spec.contact.reset();
    return spec;
  }

  sim::SystemSpec spec_;
  sim::Simulation system_;
};

// The words for what contact of surfaces did are those of its figures.
inline void check_words_of_contact(const sim::Simulation& system) {
  const auto count = [&](const char* figure, const std::string& noun) {
    const auto number = static_cast<long>(figure_of(system, figure));
    return number == 0 ? "" : std::to_string(number) + " " + noun + (number == 1 ? "" : "s");
  };
  std::string words = "contact kept none apart";
  if (figure_of(system, "steps") > 0) {
    words = "contact kept up to " + count("pairs", "pair") + " apart";
    if (const auto zones = static_cast<long>(figure_of(system, "zones")); zones > 0)
      words += ", " + std::to_string(zones) + " particles as one piece";
    if (const std::string steps = count("shortened", "step"); !steps.empty())
      words += ", in " + steps + " what constraints join went a shorter way";
  }
  for (const auto& each : system.corrections()) CHECK(each->account().words == words);
}

}  // namespace sim_test
