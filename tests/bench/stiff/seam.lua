-- A cloth whose last row is tied by stiff springs.
local sim = require "sim"
local n = sim.arg("n", 64, "particles a side")
local seam_stiffness = sim.arg("seam", 1e6, "of the springs of the last row, N/m; 0 = none")
local drag = sim.arg("drag", 2, "times the mass of a particle, 1/s")
local s, m = 1 / n, 1 / (n * n)
local cloth = sim.grid { n, n, origin = {0, 0, 0}, du = {0, 0, s}, dv = {s, 0, 0}, mass = m }
cloth:pin(cloth:id(0, 0), cloth:id(0, n - 1))
local function springs(family, k, offsets)
  return sim.force.spring { family = family, stiffness = k, grid = cloth, offsets = offsets }
end
local forces = {
  sim.force.gravity { g = {0, -9.81, 0} },
  springs("structural", 100, { {0, 1}, {1, 0} }),
  springs("shear", 50, { {1, 1}, {1, -1} }),
  springs("flex", 25, { {0, 2}, {2, 0} }),
}
if drag > 0 then forces[#forces + 1] = sim.force.drag { k = drag * m } end
if seam_stiffness > 0 then
  local seam = sim.force.spring { family = "seam", stiffness = seam_stiffness }
  for j = 0, n - 2 do seam:tie(cloth:id(n - 1, j), cloth:id(n - 1, j + 1)) end
  forces[#forces + 1] = seam
end
return sim.scene { name = "seam", particles = cloth, forces = forces,
  integrator = "imex", dt = 0.001, duration = 1 }
