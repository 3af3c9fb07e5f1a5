-- flag.lua: a flag of cols x rows particles on a pole, in a wind that comes in gusts.
local sim = require "sim"
local rows = sim.arg("rows", 16, "particles along the pole")
local cols = sim.arg("cols", 24, "particles from the pole to the free edge")
local speed = sim.arg("speed", 5, "m/s, mean of the wind")
local breeze = sim.arg("breeze", 1.5, "m/s, strength of the gusts on each axis")

-- 0.16 kg/m^2, and springs that keep their stiffness per length whatever the number of particles.
local width, height = 1.5, 1
local du, dv = height / (rows - 1), width / (cols - 1)
local m = 0.16 * width * height / (rows * cols)
local flag = sim.grid { rows, cols, origin = {0, 2, 0}, du = {0, -du, 0}, dv = {dv, 0, 0}, mass = m }
for i = 0, rows - 1 do flag:pin(flag:id(i, 0)) end

local k = sim.arg("stiffness", 40, "N/m, of a structural spring")
local function springs(family, stiffness, offsets)
  return sim.force.spring { family = family, stiffness = stiffness, damping = 0.002, grid = flag, offsets = offsets }
end
local skin = sim.surface { grid = flag }
local wind = sim.force.wind { surface = skin, velocity = {speed, 0, 0.15 * speed}, breeze = breeze, tau = 0.4, length = 0.6 }

return sim.scene { name = "flag", particles = flag, surfaces = { skin }, switches = { wind = wind },
  contact = sim.contact { surfaces = { skin }, thickness = math.min(0.02, 0.3 * math.min(du, dv)) },
  forces = { sim.force.gravity { g = {0, -9.81, 0} }, wind,
    springs("structural", k, { {0, 1}, {1, 0} }),
    springs("shear", k / 2, { {1, 1}, {1, -1} }),
    springs("flex", k / 20, { {0, 2}, {2, 0} }) },
  -- The fastest mode is below sqrt(12 k / m); a step of 1 / that is well inside the limits.
  integrator = "rk4", dt = math.min(0.005, (m / (12 * k)) ^ 0.5), duration = 5 }
