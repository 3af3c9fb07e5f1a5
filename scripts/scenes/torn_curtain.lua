-- A curtain whose threads break where they are stretched too far, and a ball that goes through it.
local sim = require "sim"
local n = sim.arg("n", 24, "particles a side")
local strength = sim.arg("strength", 0.3, "strain at which a thread breaks")
local k = sim.arg("stiffness", 200, "of the structural springs, N/m")
local speed = sim.arg("speed", 3, "of the ball, m/s")
local s, m = 1 / n, 1 / (n * n)

local curtain = sim.grid { n, n, origin = {0,0,0}, du = {0,-s,0}, dv = {s,0,0}, mass = m }
for j = 0, n - 1, 2 do curtain:pin(curtain:id(0, j)) end
local function springs(family, stiffness, offsets)
  return sim.force.spring { family = family, stiffness = stiffness, break_strain = strength,
    grid = curtain, offsets = offsets }
end
local ball = sim.collider.sphere { radius = 0.15, center = {0.5, -0.6, 0.5}, thickness = 0.005,
  motion = sim.motion.line { velocity = {0, 0, -speed} } }

return sim.scene { name = "torn_curtain", particles = curtain, colliders = { ball },
  forces = { sim.force.gravity {}, sim.force.drag { k = 2 * m },
    springs("structural", k, { {0,1}, {1,0} }),
    springs("shear", k / 2, { {1,1}, {1,-1} }) },
  integrator = "verlet", dt = 0.2 / math.sqrt(k / m), duration = 1 }
