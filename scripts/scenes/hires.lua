-- HIRES: how light makes a plant grow, eight reactions (Schaefer 1975; Hairer & Wanner, Solving
-- ODEs II (1996), section IV.10).
local sim = require "sim"

return sim.scene { name = "hires", state = { 1, 0, 0, 0, 0, 0, 0, 0.0057 },
  field = sim.field.formula {
    "-1.71*a + 0.43*b + 8.32*c + 0.0007",
    "1.71*a - 8.75*b",
    "-10.03*c + 0.43*d + 0.035*e",
    "8.32*b + 1.71*c - 1.12*d",
    "-1.745*e + 0.43*f + 0.43*g",
    "-280*f*h + 0.69*d + 1.71*e - 0.43*f + 0.69*g",
    "280*f*h - 1.81*g",
    "-280*f*h + 1.81*g",
    names = {"a", "b", "c", "d", "e", "f", "g", "h"} },
  integrator = sim.integrator.bdf { rtol = 1e-6, atol = 1e-9 }, dt = 321.8122 / 100,
  duration = 321.8122 }
