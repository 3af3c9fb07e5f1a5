// The springs attached to one particle: `sim adjacency SCENE I` and --debug-particle I.
#pragma once

#include <cstdint>
#include <string>

#include "cli/run/scene.h"
#include "cli/terminal/console.h"

namespace sim::cli {

// `I`, or `NAME:I` for the system NAME of a world. Without a name: that particle of every
// second-order system that has it.
struct ParticleChoice {
  std::string system;
  std::int64_t id = 0;
};

struct AdjacencyRequest {
  SceneRequest scene;
  ParticleChoice particle;
  bool json = false;
};

// Throws Error{kUsage} when no system has the particle, or none that has springs.
void check_particle(const LoadedScene& scene, const ParticleChoice& choice);

// Scene, particle and one row a family: k, rest length, neighbours in ascending order. JSON: one
// object a line, with length in m, force = k (length - rest) in N, positive when stretched.
void print_adjacency(const LoadedScene& scene, const ParticleChoice& choice, bool json,
                     std::ostream& out);

// The present state of each spring of the particle: length, strain, force in N, positive when
// stretched, and the largest step that is stable for this spring and its two ends alone.
void print_spring_states(LoadedScene& scene, const ParticleChoice& choice, std::ostream& out);

int adjacency(const AdjacencyRequest& request, const Environment& environment, Registry& registry,
              Console& console);

}  // namespace sim::cli
