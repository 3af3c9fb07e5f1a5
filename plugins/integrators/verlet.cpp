// Velocity Verlet. Verlet (1967), Phys. Rev. 159, 98-103; as a splitting: Hairer, Lubich & Wanner
// (2003), Acta Numerica 12, 399-450, section 1.
#include "core/ode/splitting.h"
#include "core/plugin/plugin.h"

SIM_PLUGIN(kIntegrator, "verlet") {
  registrar.add(sim::IntegratorPlugin{
      {.name = "verlet",
       .summary = "velocity Verlet: one evaluation, second order, symplectic; h omega < 2",
       .formula = "v += h/2 a(t, q);  q += h v;  v += h/2 a(t + h, q)\n"
                  "with damping gamma a kick of length k is exactly\n"
                  "v := e^(-gamma k) v + (1 - e^(-gamma k)) / gamma a",
       .source = "Verlet (1967), Phys. Rev. 159, 98-103"},
      [](const sim::Params&) {
        return std::make_unique<sim::Splitting>(sim::SplitPlan{{0, 1, 0}, {0.5, 0.5}}, 2);
      }});
}
