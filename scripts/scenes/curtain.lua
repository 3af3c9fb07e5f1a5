-- A curtain on hooks, every third particle of its top, and a sphere that swings through it.
local sim = require "sim"
local n = sim.arg("n", 16, "particles a side")
local hooks = sim.arg("hooks", 3, "one at every so many particles")
local radius = sim.arg("radius", 0.25, "of the sphere, m")
local friction = sim.arg("friction", 0.3, "of the sphere")
local period = sim.arg("period", 3, "of its swing, s")
local k = sim.arg("stiffness", 200, "of the structural springs, N/m")
local s, m = 1 / n, 1 / (n * n)

-- Row 0 is the top; the curtain hangs in the plane z = 0.
local curtain = sim.grid { n, n, origin = {0,0,0}, du = {0,-s,0}, dv = {s,0,0}, mass = m }
for j = 0, n - 1, hooks do curtain:pin(curtain:id(0, j)) end
local function springs(family, stiffness, offsets)
  return sim.force.spring { family = family, stiffness = stiffness, grid = curtain, offsets = offsets }
end

local ball = sim.collider.sphere {
  radius = radius, center = {0.5, -0.65, 0},
  -- From the right of the curtain, through it, and back.
  motion = sim.motion.swing { amplitude = {0, 0, 0.3 + radius}, period = period, phase = math.pi / 2 },
  friction = friction, thickness = math.max(0.005, s * s / (8 * radius)),
}

return sim.scene { name = "curtain", particles = curtain, colliders = { ball },
  forces = { sim.force.gravity { g = {0, -9.81, 0} }, sim.force.drag { k = 2 * m },
    springs("structural", k, { {0,1}, {1,0} }),
    springs("shear", k / 2, { {1,1}, {1,-1} }),
    springs("flex", k / 4, { {0,2}, {2,0} }) },
  -- omega^2 of the fastest mode is at most 8 times the sum of the stiffnesses over m.
  integrator = "verlet", dt = math.min(0.004, period / 200, 0.4 / math.sqrt(k / m)), duration = 6 }
