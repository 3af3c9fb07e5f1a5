#include "core/scene/scene_spec.h"

namespace sim {

ParticleSpec ParticlesSpec::at(int id) const {
  const int in_grid = grid ? grid->rows * grid->cols : 0;
  if (id >= in_grid) return list[static_cast<std::size_t>(id - in_grid)];
  ParticleSpec particle;
  const double i = id / grid->cols, j = id % grid->cols;
  particle.position = grid->origin + i * grid->du + j * grid->dv;
  particle.mass = grid->mass;
  return particle;
}

}  // namespace sim
