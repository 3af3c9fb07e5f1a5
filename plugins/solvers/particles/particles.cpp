// Implicit stages of particles: Newton's method on the incremental potential, and what it needs.
#include "core/plugin/plugin.h"
#include "particle_solvers.h"

SIM_PLUGIN(ImplicitSolvers, "particles") {
  registrar.add(sim::Plugin<sim::ImplicitSolvers>{
      {.name = "particles",
       .summary = "stages of implicit methods on particles, with springs, contact and constraints",
       .formula = "Y - tau f(t, Y) = r,  q = r_q + tau v:  g(v) = 0, for springs the gradient of\n"
                  "1/2 |v - r_v|^2_M + tau/2 c |v|^2 + U(r_q + tau v) - tau m g.v",
       .source =
           "Martin, Thomaszewski, Grinspun & Gross (2011), ACM TOG 30(4) 72; Gast, Schroeder, "
           "Stomakhin, Jiang & Teran (2015), IEEE TVCG 21(10)"},
      [](const sim::Params&, sim::ParticleSystem& system) {
        return sim::make_particle_solvers(system);
      }});
}
