-- Kuramoto's oscillators in a ring of n: each has a frequency of its own and follows its neighbours
-- (Kuramoto 1975; Acebron et al. (2005), Rev. Mod. Phys. 77, 137-185).
local sim = require "sim"
local n = sim.arg("n", 64, "oscillators")
local coupling = sim.arg("coupling", 1, "rad/s; with little each keeps its own frequency")

local state = {}
for i = 1, n do
  state[2 * i - 1] = 2.4 * math.sin(7 * i)          -- phase
  state[2 * i] = 1 + 0.2 * math.sin(3 * i * i)      -- its own frequency, which stays
end
return sim.scene { name = "kuramoto", state = state,
  field = sim.field.formula { "omega + k*(sin(theta[-1] - theta) + sin(theta[1] - theta))", "0",
    names = {"theta", "omega"}, cells = n, boundary = "periodic", k = coupling },
  integrator = sim.integrator.dopri5 { tol = 1e-8 }, dt = 0.1, duration = 20 }
