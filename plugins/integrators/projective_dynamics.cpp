// Projective dynamics: backward Euler on springs, solved by alternating local and global steps.
#include "core/ode/implicit/implicit.h"
#include "core/plugin/plugin.h"

namespace {

constexpr sim::Tableau<1> kImplicitEuler{.a = {{{1}}}, .b = {1}, .c = {1}};
static_assert(sim::order_conditions(kImplicitEuler) == 1);

}  // namespace

SIM_PLUGIN(Integrator, "projective_dynamics") {
  registrar.add(sim::IntegratorPlugin{
      {.name = "projective_dynamics",
       .summary = "backward Euler, approached in a fixed number of cheap iterations; springs only",
       .formula = "local:  p = r d/|d| for each spring\n"
                  "global: (M/h^2 + c/h + L) q = M/h^2 (x + h v + h^2 g) + c/h x + sum k p,  v = "
                  "(q - x)/h\n"
                  "The limit of many iterations is implicit_euler; few damp more.",
       .source = "Liu, Bargteil, O'Brien & Kavan (2013), ACM TOG 32(6) 214",
       .params = {{.name = "iterations",
                   .type = sim::ParamType::kInteger,
                   .default_value = std::int64_t{10},
                   .doc = "local and global steps in each time step",
                   .min = 1,
                   .max = 100000}}},
      [](const sim::Params& given) {
        return std::make_unique<sim::DiagonallyImplicit>(
            kImplicitEuler, 1,
            sim::StageOptions{.newton_steps = static_cast<int>(given.integer("iterations")),
                              .method = sim::StageOptions::Method::kLocalGlobal});
      }});
}
