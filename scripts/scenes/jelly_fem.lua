-- The jelly of jelly.lua by finite elements instead of springs: a block of n x n x n particles hung
-- by its top layer. With young = 2.5 / a * (edge + 2 face + 4/3 body) / 3 and poisson = 1/4 it is as
-- stiff as the block of springs, and it may have any other ratio, too.
local sim = require "sim"
local n = sim.arg("n", 6, "particles a side")
local a = sim.arg("spacing", 0.1, "m")
local block = sim.grid { n, n, n, du = {a, 0, 0}, dv = {0, a, 0}, dw = {0, 0, a} }
for i = 0, n - 1 do
  for k = 0, n - 1 do block:pin(block:id(i, n - 1, k)) end
end

return sim.scene {
  name = "jelly_fem", particles = block,
  forces = {
    sim.force.gravity { g = {0, -9.81, 0} },
    sim.force.drag { k = sim.arg("drag", 0.02, "kg/s, of each particle") },
    sim.force.fem { cells = sim.cells { grid = block, order = sim.arg("order", 1, "1 or 2") },
      young = sim.arg("young", 2000, "Young's modulus, Pa"),
      poisson = sim.arg("poisson", 0.25, "Poisson's ratio"),
      density = sim.arg("density", 10, "kg/m^3"),
      model = sim.arg("model", "neo_hookean", "neo_hookean, corotated or stvk") },
  },
  integrator = "rk4", dt = 0.002, duration = 2,
}
