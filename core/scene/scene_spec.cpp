#include "core/scene/scene_spec.h"

#include <algorithm>

#include "core/geometry/cells.h"
#include "core/geometry/triangle_mesh.h"

namespace sim {

std::array<int, 3> GridSpec::at(int id) const {
  id -= first;
  if (size[2] == 1) return {id / size[1], id % size[1], 0};  // divisions are slow
  return {id / size[2] / size[1], id / size[2] % size[1], id % size[2]};
}

std::vector<std::array<int, 3>> GridSpec::triangles() const {
  const bool mirrored = directions == 3 && du.cross(dv).dot(dw) < 0;
  std::vector<std::array<int, 3>> list = grid_triangles(size, mirrored);
  for (std::array<int, 3>& triangle : list)
    for (int& id : triangle) id += first;
  return list;
}

ParticleSpec ParticlesSpec::at(int id) const {
  const int in_grid = grid ? grid->count() : 0;
  const double weight = weights.empty() ? 0 : weights[static_cast<std::size_t>(id)];
  ParticleSpec particle;
  if (id >= in_grid) {
    particle = list[static_cast<std::size_t>(id - in_grid)];
    if (weight > 0) particle.mass = weight;
    return particle;
  }
  const std::array<int, 3> at = grid->at(id);
  const double i = at[0], j = at[1], k = at[2];
  particle.position = grid->origin + i * grid->du + j * grid->dv;
  if (k > 0) particle.position += k * grid->dw;
  particle.mass = weight > 0 ? weight : grid->mass;
  return particle;
}

const GridSpec* ParticlesSpec::grid_of(int id) const {
  if (grid && grid->has(id)) return &*grid;
  const auto behind = std::ranges::upper_bound(added_grids, id, {}, &GridSpec::first);
  return behind != added_grids.begin() && behind[-1].has(id) ? &behind[-1] : nullptr;
}

void weigh_cells(SystemSpec& spec) {
  if (!spec.particles) return;
  ParticlesSpec& particles = *spec.particles;
  for (const PartSpec& part : spec.forces) {
    const auto given = part.given.find("density");
    if (!part.elements.cells || given == part.given.end()) continue;
    const auto* whole = std::get_if<std::int64_t>(&given->second);
    const auto* real = std::get_if<double>(&given->second);
    const double density = whole ? static_cast<double>(*whole) : real ? *real : 0;
    particles.weights.resize(static_cast<std::size_t>(particles.count()));
    const auto at = [&](int id) { return particles.at(id).position; };
    const auto arity = static_cast<std::size_t>(part.elements.arity);
    for (std::size_t e = 0; e < part.elements.listed(); ++e) {
      const std::span<const int> ids = std::span(part.elements.ids).subspan(e * arity, arity);
      const double mass = density * cell_volume(ids, at);
      for (std::size_t node = 0; node < arity; ++node)
        particles.weights[static_cast<std::size_t>(ids[node])] +=
            lumped_share(part.elements.arity, static_cast<int>(node)) * mass;
    }
  }
}

std::vector<double> SystemSpec::observe(const Simulation& system) const {
  std::vector<double> values;
  for (const ObserverSpec& observer : observers) values.push_back(observer.value(system));
  return values;
}

}  // namespace sim
