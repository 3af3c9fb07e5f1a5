-- The Brusselator with diffusion in a square whose sides meet, n x n cells (Hairer & Wanner,
-- Solving ODEs II (1996), section IV.10).
local sim = require "sim"
local n = sim.arg("n", 32, "cells a side")

local state = {}
for i = 0, n - 1 do
  for j = 0, n - 1 do
    local x, y = i / n, j / n
    state[#state + 1] = 22 * y * (1 - y)^1.5
    state[#state + 1] = 27 * x * (1 - x)^1.5
  end
end
return sim.scene { name = "brusselator2d", state = state,
  field = sim.field.formula {
    "1 + u^2*v - 4.4*u + a*(u[-1,0] + u[1,0] + u[0,-1] + u[0,1] - 4*u)",
    "3.4*u - u^2*v + a*(v[-1,0] + v[1,0] + v[0,-1] + v[0,1] - 4*v)",
    names = {"u", "v"}, cells = {n, n}, boundary = "periodic", a = 0.1 * n^2 },
  integrator = sim.integrator.bdf { tol = 1e-5 }, dt = 0.05, duration = 1 }
