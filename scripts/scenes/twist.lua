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
-- Each particle of an end is drawn to its place on a bar that turns about the x axis.
local forces = { sim.force.drag { k = 2 * m },
  springs("structural", k, { {0,1}, {1,0} }),
  springs("shear", k / 2, { {1,1}, {1,-1} }),
  springs("flex", k / 40, { {0,2}, {2,0} }) }
local duration = 0.5 * turns * period
local function hold(i, column, sign)
  forces[#forces + 1] = sim.force.expression { particles = { cloth:id(i, column) }, k = k,
    x0 = sign * half, r = s * i - half, w = sign * 2 * math.pi / period, T = duration,
    c = sign * 0.4 / duration,
    energy = "0.5*k*((x - x0 + c*u)^2 + (y - r*sin(w*u))^2 + (z - r*cos(w*u))^2); u = min(t, T)" }
end
for i = 0, n - 1 do
  hold(i, 0, -1)
  hold(i, n - 1, 1)
end

return sim.scene { name = "twist", particles = cloth, forces = forces,
  contact = sim.contact { surfaces = { sim.surface { grid = cloth } }, thickness = thickness,
    friction = friction },
  -- omega^2 of the fastest mode is at most 8 times the sum of the stiffnesses over m.
  integrator = "verlet", dt = math.min(0.004, 0.1 / math.sqrt(k / m)), duration = duration + 0.5 }
