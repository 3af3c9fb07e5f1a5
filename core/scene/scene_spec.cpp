#include "core/scene/scene_spec.h"

namespace sim {

std::array<int, 3> GridSpec::at(int id) const {
  if (size[2] == 1) return {id / size[1], id % size[1], 0};  // divisions are slow
  return {id / size[2] / size[1], id / size[2] % size[1], id % size[2]};
}

ParticleSpec ParticlesSpec::at(int id) const {
  const int in_grid = grid ? grid->count() : 0;
  if (id >= in_grid) return list[static_cast<std::size_t>(id - in_grid)];
  ParticleSpec particle;
  const std::array<int, 3> at = grid->at(id);
  const double i = at[0], j = at[1], k = at[2];
  particle.position = grid->origin + i * grid->du + j * grid->dv;
  if (k > 0) particle.position += k * grid->dw;
  particle.mass = grid->mass;
  return particle;
}

std::vector<double> SystemSpec::observe(const Simulation& system) const {
  std::vector<double> values;
  for (const ObserverSpec& observer : observers) values.push_back(observer.value(system));
  return values;
}

}  // namespace sim
