-- The Oregonator: a reaction of three species that runs in circles, through six decades (Field &
-- Noyes 1974; Hairer & Wanner, Solving ODEs II (1996), section IV.10).
local sim = require "sim"

return sim.scene { name = "oregonator", state = { 1, 2, 3 },
  field = sim.field.formula { "77.27*(b + a*(1 - 8.375e-6*a - b))", "(c - (1 + a)*b)/77.27",
    "0.161*(a - c)", names = {"a", "b", "c"} },
  integrator = sim.integrator.bdf { rtol = 1e-6, atol = 1e-8 }, dt = 1, duration = 360 }
