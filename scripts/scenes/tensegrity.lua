-- A prism of three struts that touch nowhere, held by nine cables. Its ends are turned against each
-- other by 30 degrees along the cables between them, whatever the stiffness (Kenner 1976).
local sim = require "sim"
local pull = sim.arg("pull", 0.05, "share by which cables are shorter than they begin")
local turn = sim.arg("turn", 45, "of the upper triangle at the start, degrees")
local k = sim.arg("stiffness", 400, "of the cables, N/m")

local prism = sim.particles { mass = 0.1 }
local function triangle(height, turned)
  local ids = {}
  for i = 1, 3 do
    local a = 2 * math.pi * i / 3 + math.rad(turned)
    ids[i] = prism:add { 0.3 * math.cos(a), height, 0.3 * math.sin(a) }
  end
  return ids
end
local lower, upper = triangle(0, 0), triangle(0.6, turn)

local function distance(a, b)
  local height = (a <= 2 and 0 or 0.6) - (b <= 2 and 0 or 0.6)
  local angle = 2 * math.pi * (a % 3 - b % 3) / 3
    + math.rad((a <= 2 and 0 or turn) - (b <= 2 and 0 or turn))
  return math.sqrt(height^2 + 0.36 * math.sin(angle / 2)^2)
end
local function members(force, share)
  return function(a, b) force:tie(a, b, { rest = share * distance(a, b) }) end
end
local cables = sim.force.spring { family = "cable", stiffness = k, damping = 2, tension_only = true }
local struts = sim.force.spring { family = "strut", stiffness = 20 * k, damping = 2,
  compression_only = true }
local cable, strut = members(cables, 1 - pull), members(struts, 1)
for i = 1, 3 do
  local after = i % 3 + 1
  cable(lower[i], lower[after])
  cable(upper[i], upper[after])
  cable(lower[i], upper[i])
  strut(lower[i], upper[after])
end

return sim.scene { name = "tensegrity", particles = prism, forces = { cables, struts, sim.force.drag { k = 0.2 } },
  observe = { turn = function(s)  -- degrees, of the upper triangle against the lower one
    local function angle(id, a, b, c)
      local p, q, r, v = s:position(a), s:position(b), s:position(c), s:position(id)
      return math.atan(v[3] - (p[3] + q[3] + r[3]) / 3, v[1] - (p[1] + q[1] + r[1]) / 3)
    end
    local difference = angle(upper[1], upper[1], upper[2], upper[3])
      - angle(lower[1], lower[1], lower[2], lower[3])
    return math.deg(difference % (2 * math.pi))
  end },
  integrator = "rk4", dt = 0.002, duration = 10 }
