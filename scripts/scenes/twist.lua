-- A cloth wrung by its ends: two bars turn against each other, four turns in all, and come nearer.
local sim = require "sim"
local n = sim.arg("n", 16, "particles a side")
local turns = sim.arg("turns", 4, "of one end against the other")
local period = sim.arg("period", 1, "of a turn, s")
local friction = sim.arg("friction", 0.3, "of the cloth on itself")
local k = sim.arg("stiffness", 200, "of the structural springs, N/m")
local thickness = sim.arg("thickness", 0.2 / n, "that layers keep from each other, m")
local s, m = 1 / n, 1 / (n * n)
local half = 0.5 * (1 - s)

local cloth = sim.grid { n, n, origin = {-half, 0, -half}, du = {0,0,s}, dv = {s,0,0}, mass = m }
local function springs(family, stiffness, offsets)
  return sim.force.spring { family = family, stiffness = stiffness, grid = cloth, offsets = offsets,
    damping = 2 * m }
end
local forces = { sim.force.drag { k = 2 * m },
  springs("structural", k, { {0,1}, {1,0} }),
  springs("shear", k / 2, { {1,1}, {1,-1} }),
  springs("flex", k / 40, { {0,2}, {2,0} }) }
-- Each particle of an end is led around the x axis, at r from it.
local duration = 0.5 * turns * period
local function lead(i, column, sign)
  local r, w, c = s * i - half, sign * 2 * math.pi / period, sign * 0.4 / duration
  cloth:prescribe(cloth:id(i, column), function(t)
    local u, on = math.min(t, duration), t < duration and 1 or 0
    local sine, cosine = math.sin(w * u), math.cos(w * u)
    return { sign * half - c * u, r * sine, r * cosine },
      { -on * c, on * w * r * cosine, -on * w * r * sine }
  end)
end
for i = 0, n - 1 do
  lead(i, 0, -1)
  lead(i, n - 1, 1)
end

return sim.scene { name = "twist", particles = cloth, forces = forces,
  contact = sim.contact { surfaces = { sim.surface { grid = cloth } }, thickness = thickness,
    friction = friction },
  -- omega^2 of the fastest mode is at most 8 times the sum of the stiffnesses over m.
  integrator = "verlet", dt = math.min(0.004, 0.1 / math.sqrt(k / m)), duration = duration + 0.5 }
