-- scenes/brusselator.lua with a right-hand side in Lua.
local sim = require "sim"
local n = 200
local a = 0.02 * (n + 1)^2

local state = {}
for i = 1, n do
  state[2 * i - 1] = 1 + math.sin(2 * math.pi * i / (n + 1))
  state[2 * i] = 3
end

local function slopes(_, x)
  local f = {}
  local u0, v0, u, v = 1, 3, x[1], x[2]
  for i = 1, n do
    local u1, v1 = x[2 * i + 1] or 1, x[2 * i + 2] or 3
    local product = u * u * v
    f[2 * i - 1] = 1 + product - 4 * u + a * (u0 - 2 * u + u1)
    f[2 * i] = 3 * u - product + a * (v0 - 2 * v + v1)
    u0, v0, u, v = u, v, u1, v1
  end
  return f
end

return sim.scene { name = "brusselator_lua", state = state, field = sim.field.lua { slopes },
  integrator = sim.integrator.bdf { tol = 1e-5 }, dt = 0.1, duration = 10 }
