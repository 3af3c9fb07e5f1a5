// The surface of a liquid: its particles drawn as one closed mesh.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/math/vec3.h"
#include "core/picture/model.h"

namespace sim {

struct LiquidSurface {
  std::vector<Vec3> points;                   // m
  std::vector<std::array<int, 3>> triangles;  // counterclockwise from outside
  std::vector<double> values;                 // of the points, from those of the particles
};

// The particles that are neither pinned, nor part of a solid, nor joined to others; none if they
// are fewer than 60.
std::vector<int> liquid_of(const Model& model);

// The median distance from a particle of a liquid to the nearest other one, m.
double liquid_spacing(const Frame& frame, std::span<const int> liquid);

// The points whose distance from the weighted mean of the particles around them is 0.62 spacings
// (Zhu & Bridson (2005), Animating sand as a fluid, eq. 4 with the same radius for all), as a net
// with a point in each cell of a grid that the surface crosses (Gibson (1998), Constrained elastic
// surface nets). `values` of the particles are averaged likewise; empty: there are none. Positions
// are finite.
LiquidSurface liquid_surface(std::span<const Vec3> particles, double spacing,
                             std::span<const double> values);

}  // namespace sim
