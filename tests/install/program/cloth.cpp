// The cloth of scenes/cloth.lua without Lua: the kernel alone, and the plugins named below.
#include <cmath>
#include <cstdio>

#include "core/scene/simulation.h"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  constexpr int n = 8;
  const double s = 1.0 / n, mass = s * s;  // m, kg
  sim::SystemSpec cloth{.name = "cloth"};
  cloth.particles = sim::ParticlesSpec{
      .grid = sim::GridSpec{.size = {n, n, 1}, .du = {0, 0, s}, .dv = {s, 0, 0}, .mass = mass},
      .pinned = {0, n - 1}};
  cloth.forces = {{"gravity", {}}, {"drag", {{"k", 2 * mass}}}};
  const auto springs = [&](double stiffness, int a, int b, int c, int d) {  // along (a, b), (c, d)
    sim::PartSpec part{"spring", {{"stiffness", stiffness}}};
    for (const auto [i, j] : {std::pair(a, b), std::pair(c, d)})
      part.elements.grids.push_back({0, {n, n, 1}, {i, j, 0}, std::hypot(i * s, j * s)});
    cloth.forces.push_back(part);
  };
  springs(100, 0, 1, 1, 0);
  springs(50, 1, 1, 1, -1);
  springs(25, 0, 2, 2, 0);
  cloth.integrator = "rk4";
  cloth.dt = 0.005;  // s

  sim::Registry plugins({argv[1]});  // a folder as lib/sim/plugins
  sim::Simulation simulation(cloth, plugins);
  while (simulation.t() < 2 && simulation.step()) {}
  std::printf("t = %g s, hash %016lx\n", simulation.t(), simulation.hash());
}
