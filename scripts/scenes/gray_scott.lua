-- Gray & Scott's reaction with diffusion: spots that grow and divide (Pearson 1993, Science 261,
-- 189-192).
local sim = require "sim"
local n = sim.arg("n", 128, "cells a side")
local feed = sim.arg("feed", 0.035, "rate of feeding")
local kill = sim.arg("kill", 0.065, "rate of removal, beside feeding")

local state = {}
for i = 0, n - 1 do
  for j = 0, n - 1 do
    local spot = math.exp(-((i - 0.45 * n)^2 + (j - 0.55 * n)^2) / (0.002 * n^2))
    state[#state + 1] = 1 - 0.5 * spot
    state[#state + 1] = 0.25 * spot
  end
end
return sim.scene { name = "gray_scott", state = state,
  field = sim.field.formula {
    "p*(u[-1,0] + u[1,0] + u[0,-1] + u[0,1] - 4*u) - u*v^2 + feed*(1 - u)",
    "q*(v[-1,0] + v[1,0] + v[0,-1] + v[0,1] - 4*v) + u*v^2 - (feed + kill)*v",
    names = {"u", "v"}, cells = {n, n}, boundary = "periodic", p = 0.16, q = 0.08,
    feed = feed, kill = kill },
  integrator = "rk4", dt = 1, duration = 2000 }
