-- A cloth that falls on a sphere at rest and stays there by friction; without it, it slides off.
local sim = require "sim"
local n = sim.arg("n", 16, "particles a side")
local radius = sim.arg("radius", 0.3, "of the sphere, m")
local friction = sim.arg("friction", 0.5, "of the sphere")
local height = sim.arg("height", 0.1, "from which the cloth falls, m")
local k = sim.arg("stiffness", 200, "of the structural springs, N/m")
local s, m = 1 / n, 1 / (n * n)
local thickness = math.max(0.005, s * s / (8 * radius))

local cloth = sim.grid { n, n, origin = {-0.5, height, -0.5}, du = {0,0,s}, dv = {s,0,0}, mass = m }
local function springs(family, stiffness, offsets)
  return sim.force.spring { family = family, stiffness = stiffness, grid = cloth, offsets = offsets }
end

return sim.scene { name = "drape", particles = cloth,
  colliders = { sim.collider.sphere { radius = radius, center = {0, -radius - thickness, 0},
    friction = friction, thickness = thickness } },
  forces = { sim.force.gravity { g = {0, -9.81, 0} }, sim.force.drag { k = 2 * m },
    springs("structural", k, { {0,1}, {1,0} }),
    springs("shear", k / 2, { {1,1}, {1,-1} }),
    springs("flex", k / 4, { {0,2}, {2,0} }) },
  -- omega^2 of the fastest mode is at most 8 times the sum of the stiffnesses over m.
  integrator = "verlet", dt = math.min(0.004, 0.4 / math.sqrt(k / m)), duration = 3 }
