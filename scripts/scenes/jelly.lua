-- A block of n x n x n particles falls on a corner, tumbles and wobbles: springs along the edges of
-- its cells, across their faces and through their bodies. With edge = face + 8/3 body it is isotropic, Poisson's ratio
-- 1/4; for a = spacing its modulus of compression along an edge is (edge + 2 face + 4/3 body) / a.
local sim = require "sim"
local n = sim.arg("n", 6, "particles a side")
local a = sim.arg("spacing", 0.1, "m")
local m = sim.arg("mass", 0.01, "kg, of each particle")

-- Turned about two axes, so that it lands on a corner: columns of a rotation, times the spacing.
local c, d = math.cos(0.5), math.sin(0.5)
local block = sim.grid { n, n, n, origin = {0, sim.arg("height", 0.2, "m, of the lowest corner") + (n - 1) * a * d, 0},
  du = {a * c, a * d * c, a * d * d}, dv = {-a * d, a * c * c, a * c * d}, dw = {0, -a * d, a * c}, mass = m }

local function springs(family, k, offsets)
  return sim.force.spring { family = family, stiffness = k, grid = block, offsets = offsets }
end

return sim.scene {
  name = "jelly", particles = block, surfaces = { sim.surface { grid = block } },
  forces = {
    sim.force.gravity { g = {0, -9.81, 0} },
    sim.force.drag { k = sim.arg("drag", 0.5, "1/s, of the velocity") * m },
    springs("edge", sim.arg("edge", 300, "N/m"), { {1,0,0}, {0,1,0}, {0,0,1} }),
    springs("face", sim.arg("face", 150, "N/m"),
      { {1,1,0}, {1,-1,0}, {1,0,1}, {1,0,-1}, {0,1,1}, {0,1,-1} }),
    springs("body", sim.arg("body", 75, "N/m"), { {1,1,1}, {1,1,-1}, {1,-1,1}, {1,-1,-1} }),
  },
  colliders = { sim.collider.plane { point = {0, 0, 0}, normal = {0, 1, 0}, friction = 0.3 } },
  integrator = "verlet", dt = 0.001, duration = 2,
}
