-- A sheet that cannot be stretched falls on a ball: rigid rods, contact and friction together.
local sim = require "sim"
local n = sim.arg("n", 16, "particles a side")
local radius = sim.arg("radius", 0.3, "of the ball, m")
local friction = sim.arg("friction", 0.3, "of the ball")
local height = sim.arg("height", 0.1, "from which the sheet falls, m")
local shear = sim.arg("shear", 1, "stiffness of the springs across the cells, N/m")
if shear < 0.5 then error("shear below 0.5 N/m lets the sheet fold into a line") end
if height > 0.3 then error("the sheet falls from 0.3 m at most") end
local s = 1 / n
local m = 0.1 * s * s
local thickness = math.max(0.005, s * s / (8 * radius))

local sheet = sim.grid { n, n, origin = {s/2 - 0.5, height, s/2 - 0.5}, du = {0,0,s}, dv = {s,0,0},
  mass = m }

return sim.scene { name = "drape_rods", particles = sheet,
  constraints = { sim.constraint.distance { grid = sheet, offsets = { {0,1}, {1,0} } } },
  colliders = { sim.collider.sphere { radius = radius, center = {0, -radius - thickness, 0},
    friction = friction, thickness = thickness } },
  forces = { sim.force.gravity { g = {0, -9.81, 0} }, sim.force.drag { k = 2 * m },
    sim.force.spring { family = "shear", stiffness = shear, grid = sheet,
      offsets = { {1,1}, {1,-1} } } },
  -- omega^2 of the fastest mode is at most 8 k / m.
  integrator = "verlet", dt = math.min(0.004, 0.5 / math.sqrt(8 * shear / m)), duration = 1.5 }
