// Symplectic (semi-implicit) Euler: the kick first, then the drift. Hairer, Lubich & Wanner (2003),
// Acta Numerica 12, 399-450, section 1.
#include "core/ode/splitting.h"
#include "core/plugin/plugin.h"

SIM_PLUGIN(kIntegrator, "symplectic_euler") {
  registrar.add(sim::IntegratorPlugin{
      {.name = "symplectic_euler",
       .summary = "symplectic Euler: one evaluation, first order, symplectic; h omega < 2",
       .formula = "v += h a(t, q);  q += h v\n"
                  "with damping gamma the kick is exactly\n"
                  "v := e^(-gamma h) v + (1 - e^(-gamma h)) / gamma a",
       .source = "Hairer, Lubich & Wanner (2003), Acta Numerica 12, 399-450"},
      [](const sim::Params&) {
        return std::make_unique<sim::Splitting>(sim::SplitPlan{{0, 1}, {1}}, 1);
      }});
}
