-- The cloth of cloth.lua hung by two corners, and a sphere that swings through it.
-- Only particles are kept out of the sphere: between two of them a spring may lie s^2 / (8 radius)
-- deep in it, which `thickness` covers.
local sim = require "sim"
local n = sim.arg("n", 8, "particles a side")
local radius = sim.arg("radius", 0.2, "of the sphere, m")
local friction = sim.arg("friction", 0.2, "of the sphere")
local period = sim.arg("period", 2, "of its swing, s")
local k = sim.arg("stiffness", 100, "of the structural springs, N/m")
local s, m = 1 / n, 1 / (n * n)

local cloth = sim.grid { n, n, origin = {0,0,0}, du = {0,0,s}, dv = {s,0,0}, mass = m }
cloth:pin(cloth:id(0, 0), cloth:id(0, n - 1))
local function springs(family, stiffness, offsets)
  return sim.force.spring { family = family, stiffness = stiffness, grid = cloth, offsets = offsets }
end

-- It swings below the cloth, which falls on it, and then to either side of where the cloth hangs.
local ball = sim.collider.sphere {
  radius = radius, center = {0.5 * (1 - s), -0.7 - radius, 0},
  motion = sim.motion.swing { amplitude = {0, 0, 0.5 + radius}, period = period },
  friction = friction, thickness = math.max(0.005, s * s / (8 * radius)),
}

-- A wind for who turns it on: .toggle wind.
local wind = sim.force.wind { surface = sim.surface { grid = cloth }, velocity = {0, 0, -3}, breeze = 1, on = false }

return sim.scene { name = "cloth_ball", particles = cloth, colliders = { ball },
  switches = { wind = wind, ball = ball },
  forces = { sim.force.gravity { g = {0, -9.81, 0} }, sim.force.drag { k = 2 * m }, wind,
    springs("structural", k, { {0,1}, {1,0} }),
    springs("shear", k / 2, { {1,1}, {1,-1} }),
    springs("flex", k / 4, { {0,2}, {2,0} }) },
  -- omega^2 of the fastest mode is at most 8 times the sum of the stiffnesses over m.
  integrator = "rk4", dt = math.min(0.005, period / 200, 0.6 / math.sqrt(k / m)), duration = 4 }
