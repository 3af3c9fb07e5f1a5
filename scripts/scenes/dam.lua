-- A dam breaks: a column of water in the corner of a room, let go at once. Martin & Moyce (1952),
-- Phil. Trans. R. Soc. A 244, 312-324, photographed such columns.
local sim = require "sim"
local width = sim.arg("width", 0.2, "of the column, m")
local height = sim.arg("height", 0.4, "of the column, m")
local depth = sim.arg("depth", 0.2, "of the column and of the room, m; 0: in two dimensions")
local length = sim.arg("length", 0.8, "of the room, m")
local layers = sim.arg("layers", 8, "of particles over the width of the column")
local alpha = sim.arg("alpha", 0.05, "artificial viscosity")
local solver = sim.arg("solver", "wcsph", "wcsph, or dfsph: keeps its density")
local density_error = sim.arg("density_error", 1e-3, "of dfsph")
local times = sim.arg("sound", 10, "speed of sound, over that of the fall")
local density = 1000

-- Ten times as fast as the water can fall: its density then changes by 1 %. In a step sound goes 0.6
-- of a spacing. dfsph has no sound; there the fastest water goes 0.3 of a spacing.
local sound = times * (2 * 9.81 * height)^0.5
local flat = depth == 0
local a = width / layers
local function count(extent) return math.max(1, math.floor(extent / a + 0.5)) end
local nx, ny, nz = layers, count(height), count(depth)
local water = sim.particles { mass = density * (flat and a^2 or a^3) }
-- A lattice, a little out of order: a perfect one would fall apart into rows.
local told = 0
local function off() told = told + 1; return 0.004 * ((told * 0.618034) % 1 - 0.5) end
-- Each layer is pressed together by those above it.
local y, low = {}, 0
for j = 1, ny do
  local thick = a / (1 + 7 * 9.81 * (ny - j + 0.5) * a / sound^2)^(1 / 7)
  y[j], low = low + thick / 2, low + thick
end
for i = 1, nx do
  for j = 1, ny do
    for k = 1, nz do
      water:add { (i - 0.5 + off()) * a, y[j] + off() * a,
        flat and 0 or (k - 0.5 + off()) * a }
    end
  end
end
local deep = flat and 100 or nz * a / 2
local room = sim.collider.box { center = {length / 2, 2 * height, flat and 0 or deep},
  half = {length / 2, 2 * height, deep}, inside = true,
  thickness = a / 4 }

return sim.scene { name = "dam", particles = water,
  forces = { sim.force.gravity { g = {0, -9.81, 0} },
    sim.force.fluid { particles = water, density = density, speed_of_sound = sound, alpha = alpha,
      solver = solver, density_error = density_error,
      dimensions = flat and 2 or 3, boundary = { room } } },
  colliders = { room },
  integrator = "verlet", dt = (solver == "dfsph" and times / 2 or 1) * 0.4 * 1.5 * a / sound, duration = 2 }
