-- A cloth on a table, folded twice: one edge is led over to the other, then half of it again.
local sim = require "sim"
local n = sim.arg("n", 16, "particles a side")
local friction = sim.arg("friction", 0.4, "of the cloth on itself and the table")
local k = sim.arg("stiffness", 100, "of the structural springs, N/m")
local time = sim.arg("time", 0.8, "of one fold, s")
local thickness = sim.arg("thickness", 0.2 / n, "that layers keep from each other, m")
local s, m = 1 / n, 1 / (n * n)
local half = 0.5 * (1 - s)

local cloth = sim.grid { n, n, origin = {-half, thickness, -half}, du = {0,0,s}, dv = {s,0,0}, mass = m }
local function springs(family, stiffness, offsets)
  return sim.force.spring { family = family, stiffness = stiffness, grid = cloth, offsets = offsets,
    damping = 2 * m }
end
-- Draws an edge along half a circle over the cloth, along the coordinate c, from time t0 on for one
-- fold; takes hold and lets go softly.
local function lead(ids, c, t0, height)
  return sim.force.expression { particles = ids, k = 0.2 * k, r = half - 0.5 * s, t0 = t0, T = time,
    y0 = height,
    energy = "0.5*k*w*w*(3 - 2*w)*((" .. c .. " - r*cos(a))^2 + (y - y0 - r*sin(a))^2); " ..
      "w = max(0, min(1, min(t - t0, t0 + 1.5*T - t)/(0.4*T))); a = " .. math.pi ..
      "*max(0, min(1, (t - t0)/T))" }
end
local right, far = {}, {}
for i = 0, n - 1 do right[i + 1], far[i + 1] = cloth:id(i, n - 1), cloth:id(n - 1, i) end

return sim.scene { name = "fold", particles = cloth,
  contact = sim.contact { surfaces = { sim.surface { grid = cloth } }, thickness = thickness,
    friction = friction },
  colliders = { sim.collider.plane { point = {0, 0, 0}, normal = {0, 1, 0}, friction = friction } },
  forces = { sim.force.gravity { g = {0, -9.81, 0} }, sim.force.drag { k = m },
    lead(right, "x", 0.1, 4 * thickness), lead(far, "z", 0.4 + 1.5 * time, 6 * thickness),
    springs("structural", k, { {0,1}, {1,0} }),
    springs("shear", k / 2, { {1,1}, {1,-1} }),
    springs("flex", k / 40, { {0,2}, {2,0} }) },
  -- omega^2 of the fastest mode is at most 8 times the sum of the stiffnesses over m.
  integrator = "rk4", dt = math.min(0.004, 0.1 / math.sqrt(k / m)), duration = 1 + 3 * time }
