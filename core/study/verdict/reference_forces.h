// Springs, gravity and drag in scalar code, from the scene's own list: an independent evaluation of
// the forces that the kernels of a run compute.
#pragma once

#include <string>
#include <vector>

#include "core/particles/particle_system.h"
#include "core/scene/scene_spec.h"

namespace sim::study {

// All particles of a small system are evaluated, and the first, the last and blocks in between of a
// large one: partial vectors, tiles and parts of threads end there.
class ReferenceForces {
 public:
  // Evaluates all springs once at the state of the view. `off`: switches, sorted.
  ReferenceForces(const SystemSpec& spec, const ParticleSystem& particles, const ParticleView& view,
                  const std::vector<std::string>& off);

  // False if springs are not listed as pairs with a stiffness, or a force is off: then nothing
  // below is known.
  bool known() const { return known_; }

  struct Sum {
    Vec3 force{0, 0, 0};  // N
    double scale = 0;     // N, the scale of rounding errors
  };
  const std::vector<int>& ids() const { return ids_; }
  std::vector<Sum> forces(const ParticleView& view) const;  // on each of the ids
  // Families of springs at the k-th id, or "": those along which a force is wrong, if there are
  // any.
  std::string springs_of(std::size_t k, const ParticleView& view, const Vec3& off) const;

  // Potential energy of a force at that state: of weights, in a small system of springs.
  struct Potential {
    const Force* force;
    double energy = 0, scale = 0;  // J
  };
  const std::vector<Potential>& potentials() const { return potentials_; }

 private:
  struct Tie {
    std::size_t k;  // of the id
    int to;
    std::size_t family;
    double stiffness, rest;  // N/m, m
    SpringSense sense;
  };

  void add_tie(int from, int to, double stiffness, double rest, SpringSense sense);
  void choose_ids(const ParticleView& view);
  void add_springs(const SystemSpec& spec, const PartSpec& part, const ParticleView& view,
                   Potential& potential);

  bool known_ = true;
  std::vector<int> ids_;
  std::vector<int> place_;  // of each particle among the ids, or -1
  std::vector<Tie> ties_;
  std::vector<std::string> families_;
  Vec3 gravity_{0, 0, 0};  // m/s^2
  double drag_ = 0;        // kg/s
  std::vector<Potential> potentials_;
};

}  // namespace sim::study
