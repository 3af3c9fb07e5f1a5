// Implicit methods: stable with any step on springs, at the price of solving equations in each
// step.
#include "core/ode/implicit/implicit.h"
#include "core/plugin/plugin.h"

namespace {

//   1 | 1
//  ---+---
//     | 1
constexpr sim::Tableau<1> kImplicitEuler{.a = {{{1}}}, .b = {1}, .c = {1}};
static_assert(sim::order_conditions(kImplicitEuler) == 1);

//  1/2 | 1/2
//  ----+-----
//      |  1
constexpr sim::Tableau<1> kImplicitMidpoint{.a = {{{0.5}}}, .b = {1}, .c = {0.5}};
static_assert(sim::order_conditions(kImplicitMidpoint) == 2);

// The trapezoidal rule to g h, then BDF2 over 0, g h and h; with g = 2 - sqrt 2 both equations have
// the same tau = g/2 h.
//   0 |  0
//   g | g/2  g/2
//   1 |  w    w   g/2      w = sqrt 2 / 4
//  ---+---------------
//     |  w    w   g/2
constexpr double kRoot = 1.4142135623730951, kG = 2 - kRoot, kW = kRoot / 4;
constexpr sim::Tableau<3> kTrBdf2{.a = {{{0, 0, 0}, {kG / 2, kG / 2, 0}, {kW, kW, kG / 2}}},
                                  .b = {kW, kW, kG / 2},
                                  .c = {0, kG, 1}};
static_assert(sim::order_conditions(kTrBdf2) == 2);

sim::ParamList params() {
  return {
      {.name = "tol",
       .default_value = 0.0,
       .doc = "residual of the equations at the end, relative to the one at the start; 0: small "
              "enough that the error of the method stays what it is",
       .min = 0,
       .max = 0.5},
      {.name = "newton_steps",
       .type = sim::ParamType::kInteger,
       .default_value = std::int64_t{10000},
       .doc = "at most so many; 1 = one linearised step, taken as it is (Baraff & Witkin 1998)",
       .min = 1,
       .max = 10000},
      {.name = "solver",
       .type = sim::ParamType::kText,
       .default_value = std::string("auto"),
       .doc = "of the linear equations: auto (by size), cg (matrix-free) or ldlt (sparse)"},
      {.name = "hessian",
       .type = sim::ParamType::kText,
       .default_value = std::string("exact"),
       .doc = "of compressed springs: exact (and less of it where that is not positive "
              "definite) or clamped"}};
}

template <class T>
T choice(const sim::Params& given, const std::string& name,
         std::initializer_list<std::pair<const char*, T>> choices) {
  std::string known;
  for (const auto& [text, value] : choices) {
    if (given.text(name) == text) return value;
    known += (known.empty() ? "" : ", ") + std::string(text);
  }
  throw sim::Error(sim::ErrorKind::kScene, {"integrator parameter '" + name + "'", "",
                                            "it is '" + given.text(name) + "'", "known: " + known});
}

sim::StageOptions options(const sim::Params& given, int order) {
  using Solver = sim::StageOptions::Solver;
  using Hessian = sim::StageOptions::Hessian;
  return {.tolerance = given.number("tol"),
          .order = order,
          .newton_steps = static_cast<int>(given.integer("newton_steps")),
          .solver = choice<Solver>(
              given, "solver",
              {{"auto", Solver::kAuto}, {"cg", Solver::kIterative}, {"ldlt", Solver::kDirect}}),
          .hessian = choice<Hessian>(given, "hessian",
                                     {{"exact", Hessian::kExact}, {"clamped", Hessian::kClamped}})};
}

}  // namespace

SIM_PLUGIN(Integrator, "implicit_euler/i implicit_midpoint trbdf2 bdf2") {
  registrar.add(sim::IntegratorPlugin{
      {.name = "implicit_euler",
       .summary = "backward Euler: first order, stable with any step, damps strongly",
       .formula = "x_next = x + h f(t + h, x_next)\nR(z) = 1 / (1 - z)",
       .source = "Baraff & Witkin (1998), SIGGRAPH; Martin et al. (2011), ACM TOG 30(4) 72",
       .params = params()},
      [](const sim::Params& given) {
        return std::make_unique<sim::DiagonallyImplicit>(kImplicitEuler, 1, options(given, 1));
      }});
  registrar.add(sim::IntegratorPlugin{
      {.name = "implicit_midpoint",
       .summary = "implicit midpoint: second order, symplectic; stiff modes ring without decay",
       .formula = "y = x + h/2 f(t + h/2, y);  x_next = 2 y - x\nR(z) = (1 + z/2) / (1 - z/2)",
       .source = "Hairer, Lubich & Wanner (2006), Geometric Numerical Integration, section II.1",
       .params = params()},
      [](const sim::Params& given) {
        return std::make_unique<sim::DiagonallyImplicit>(kImplicitMidpoint, 2, options(given, 2),
                                                         true);
      }});
  registrar.add(sim::IntegratorPlugin{
      {.name = "trbdf2",
       .summary = "TR-BDF2: second order, stable with any step, damps stiff modes alone",
       .formula =
           "y = x + g h/2 (f(t, x) + f(t + g h, y)),  g = 2 - sqrt 2\n"
           "x_next = 1/(g (2 - g)) y - (1 - g)^2/(g (2 - g)) x + g h/2 f(t + h, x_next)\n"
           "R(z) = ((1 + (1 - g)^2) z + 2 (2 - g)) / (z^2 g (1 - g) + z (g^2 - 2) + 2 (2 - g))",
       .source = "Bank et al. (1985), IEEE Trans. CAD 4, 436-451; Hosea & Shampine (1996), Appl. "
                 "Numer. Math. 20, 21-37",
       .params = params()},
      [](const sim::Params& given) {
        return std::make_unique<sim::DiagonallyImplicit>(kTrBdf2, 2, options(given, 2));
      }});
  registrar.add(sim::IntegratorPlugin{
      {.name = "bdf2",
       .summary = "BDF2: second order, stable with any step; the first step is one of trbdf2",
       .formula = "x_next = 4/3 x - 1/3 x_last + 2/3 h f(t + h, x_next)\n"
                  "(1 - 2/3 z) zeta^2 - 4/3 zeta + 1/3 = 0",
       .source = "Curtiss & Hirschfelder (1952), PNAS 38, 235-243; Choi & Ko (2002), SIGGRAPH",
       .params = params()},
      [](const sim::Params& given) {
        return std::make_unique<sim::Bdf2>(
            options(given, 2),
            std::make_unique<sim::DiagonallyImplicit>(kTrBdf2, 2, options(given, 2)));
      }});
}
