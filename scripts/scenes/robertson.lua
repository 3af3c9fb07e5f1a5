-- Robertson's reactions: three species, rates from 0.04 to 3e7 (Robertson 1966; Hairer & Wanner,
-- Solving ODEs II (1996), section IV.1).
local sim = require "sim"
local duration = sim.arg("duration", 40, "s; 1e11 is what few methods reach")

return sim.scene { name = "robertson", state = { 1, 0, 0 },
  field = sim.field.formula { "1e4*b*c - 0.04*a", "0.04*a - 1e4*b*c - 3e7*b^2", "3e7*b^2",
    names = {"a", "b", "c"} },
  integrator = sim.integrator.bdf { rtol = 1e-6, atol = 1e-10 }, dt = duration / 40,
  duration = duration }
