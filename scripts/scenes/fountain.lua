-- A fountain: a pump under the middle of a basin drives water up in a jet, and it falls back.
local sim = require "sim"
local layers = sim.arg("layers", 4, "of particles over the depth of the water")
local depth = sim.arg("depth", 0.12, "of the water, m")
local side = sim.arg("side", 0.6, "of the basin, m")
local jet = sim.arg("jet", 0.5, "height of the jet, m")
local alpha = sim.arg("alpha", 0.05, "artificial viscosity")
local density = 1000

local a = depth / layers
local sound = 10 * (2 * 9.81 * (jet + depth))^0.5
local n = math.max(2, math.floor(side / a + 0.5))
local half = n * a / 2
local water = sim.particles { mass = density * a^3 }
-- A lattice, a little out of order: a perfect one would fall apart into rows.
local count = 0
local function off() count = count + 1; return 0.004 * ((count * 0.618034) % 1 - 0.5) end
-- Each layer is pressed together by those above it.
local y, low = {}, 0
for j = 1, layers do
  local thick = a / (1 + 7 * 9.81 * (layers - j + 0.5) * a / sound^2)^(1 / 7)
  y[j], low = low + thick / 2, low + thick
end
for i = 1, n do
  for j = 1, layers do
    for k = 1, n do
      water:add { (i - 0.5 + off()) * a - half, y[j] + off() * a, (k - 0.5 + off()) * a - half }
    end
  end
end
local basin = sim.collider.box { center = {0, 2, 0}, half = {half, 2, half}, inside = true,
  thickness = a / 4 }

-- The pump lifts what is in its pipe by m g 2 jet/depth more than its weight: water that passes it
-- from below to the surface gets the energy for twice the jet, of which it shares half.
local pump = sim.force.expression { fy = "m*9.81*lift*exp(-(x^2 + z^2)/pipe^2 - (y/top)^4)",
  lift = 2 * jet / depth, pipe = 1.7 * a, top = depth }
return sim.scene { name = "fountain", particles = water,
  forces = { sim.force.gravity { g = {0, -9.81, 0} }, pump,
    sim.force.fluid { particles = water, density = density, speed_of_sound = sound, alpha = alpha,
      boundary = { basin } } },
  colliders = { basin },
  integrator = "verlet", dt = 0.4 * 1.5 * a / sound, duration = 2 }
