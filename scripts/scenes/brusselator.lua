-- The Brusselator with diffusion along a line: two species in n cells, stiff for many of them
-- (Hairer & Wanner, Solving ODEs II (1996), section IV.1).
local sim = require "sim"
local n = sim.arg("n", 200, "cells")

local state = {}
for i = 1, n do
  state[2 * i - 1] = 1 + math.sin(2 * math.pi * i / (n + 1))
  state[2 * i] = 3
end
return sim.scene { name = "brusselator", state = state,
  field = sim.field.formula { "1 + u^2*v - 4*u + a*(u[-1] - 2*u + u[1])",
    "3*u - u^2*v + a*(v[-1] - 2*v + v[1])",
    names = {"u", "v"}, cells = n, boundary = {1, 3}, a = 0.02 * (n + 1)^2 },
  integrator = sim.integrator.bdf { tol = 1e-5 }, dt = 0.1, duration = 10 }
