-- A block of n x n x n particles hung by its top layer: springs along the edges of its cells, across
-- their faces and through their bodies. With edge = face + 8/3 body it is isotropic, Poisson's ratio
-- 1/4; for a = spacing its modulus of compression along an edge is (edge + 2 face + 4/3 body) / a.
local sim = require "sim"
local n = sim.arg("n", 6, "particles a side")
local a = sim.arg("spacing", 0.1, "m")
local m = sim.arg("mass", 0.01, "kg, of each particle")

local block = sim.grid { n, n, n, du = {a, 0, 0}, dv = {0, a, 0}, dw = {0, 0, a}, mass = m }
for i = 0, n - 1 do
  for k = 0, n - 1 do block:pin(block:id(i, n - 1, k)) end
end

local function springs(family, k, offsets)
  return sim.force.spring { family = family, stiffness = k, grid = block, offsets = offsets }
end

return sim.scene {
  name = "jelly", particles = block, surfaces = { sim.surface { grid = block } },
  forces = {
    sim.force.gravity { g = {0, -9.81, 0} },
    sim.force.drag { k = sim.arg("drag", 2, "1/s, of the velocity") * m },
    springs("edge", sim.arg("edge", 100, "N/m"), { {1,0,0}, {0,1,0}, {0,0,1} }),
    springs("face", sim.arg("face", 50, "N/m"),
      { {1,1,0}, {1,-1,0}, {1,0,1}, {1,0,-1}, {0,1,1}, {0,1,-1} }),
    springs("body", sim.arg("body", 25, "N/m"), { {1,1,1}, {1,1,-1}, {1,-1,1}, {1,-1,-1} }),
  },
  integrator = "rk4", dt = 0.002, duration = 2,
}
