-- Heat in a rod of n cells whose ends are kept cold. A sine keeps its shape, also in cells: each
-- mode decays at its own rate, which is exact.
local sim = require "sim"
local n = sim.arg("n", 100, "cells")
local mode = sim.arg("mode", 1, "half waves along the rod")

local function shape(i) return math.sin(mode * math.pi * i / (n + 1)) end
local a = (n + 1)^2
local rate = 4 * a * math.sin(mode * math.pi / (2 * (n + 1)))^2
local state = {}
for i = 1, n do state[i] = shape(i) end
return sim.scene { name = "heat", state = state,
  field = sim.field.formula { "a*(u[-1] - 2*u + u[1])", names = {"u"}, cells = n, boundary = {0},
    a = a },
  integrator = sim.integrator.bdf { tol = 1e-6 }, dt = 0.01, duration = 0.2,
  exact = function(t)
    local u = {}
    for i = 1, n do u[i] = shape(i) * math.exp(-rate * t) end
    return u
  end }
