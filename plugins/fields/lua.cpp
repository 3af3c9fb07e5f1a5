// Any first-order ODE whose right-hand side a scene writes as a Lua function.
#include "core/plugin/plugin.h"

namespace {

class LuaField final : public sim::Field {
 public:
  explicit LuaField(sim::OdeFunction f) : f_(std::move(f)) {}

  void eval(double t, std::span<const double> x, std::span<double> dxdt) const override {
    f_(t, x, dxdt);
  }

 private:
  sim::OdeFunction f_;
};

}  // namespace

SIM_PLUGIN(Field, "lua") {
  registrar.add(sim::FieldPlugin{
      {.name = "lua",
       .summary = "a right-hand side written in Lua, for any first-order ODE",
       .formula = "x' = f(t, x)",
       .params = {{.name = "f",
                   .type = sim::ParamType::kFunction,
                   .doc =
                       "function(t, x) that returns x' as a list as long as x; it must depend on "
                       "nothing but t and x",
                   .required = true,
                   .positional = true}}},
      [](const sim::Params& params) { return std::make_unique<LuaField>(params.function("f")); }});
}
