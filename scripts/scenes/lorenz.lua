-- Lorenz' convection: three numbers, chaotic for r = 28 (Lorenz 1963, J. Atmos. Sci. 20, 130-141).
local sim = require "sim"
local s = sim.arg("s", 10, "Prandtl's number")
local r = sim.arg("r", 28, "Rayleigh's number over the critical one")
local b = sim.arg("b", 8 / 3, "shape of the rolls")

return sim.scene { name = "lorenz", state = { 1, 1, 1 },
  field = sim.field.formula { "s*(y - x)", "x*(r - z) - y", "x*y - b*z",
    names = {"x", "y", "z"}, s = s, r = r, b = b },
  integrator = "rk4", dt = 0.01, duration = 40 }
