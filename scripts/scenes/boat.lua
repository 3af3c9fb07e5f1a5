-- A boat, a barrel and a stone on water that sloshes: the boat and the barrel float, the stone sinks.
local sim = require "sim"
local layers = sim.arg("layers", 6, "of particles over the depth of the water")
local depth = sim.arg("depth", 0.24, "of the water, m")
local length = sim.arg("length", 0.96, "of the basin, m")
local width = sim.arg("width", 0.48, "of the basin, m")
local wave = sim.arg("wave", 0.15, "speed of the water at its surface at the start, m/s")
local boat_density = sim.arg("boat", 350, "of the boat, kg/m^3")
local barrel_density = sim.arg("barrel", 600, "of the barrel, kg/m^3")
local stone_density = sim.arg("stone", 2500, "of the stone, kg/m^3")

local a = depth / layers
local nx, nz = math.floor(length / a + 0.5), math.floor(width / a + 0.5)
length, width = nx * a, nz * a
local sound = 10 * (2 * 9.81 * depth)^0.5
local water = sim.particles { mass = 1000 * a^3 }
-- A lattice, a little out of order, each layer pressed together by those above it; and the lowest of
-- standing waves, as it passes its middle: Lamb (1932), Hydrodynamics, article 228.
local told = 0
local function off() told = told + 1; return 0.004 * ((told * 0.618034) % 1 - 0.5) end
local k = math.pi / length
local y, low = {}, 0
for j = 1, layers do
  local thick = a / (1 + 7 * 9.81 * (layers - j + 0.5) * a / sound^2)^(1 / 7)
  y[j], low = low + thick / 2, low + thick
end
local function cosh(q) return (math.exp(q) + math.exp(-q)) / 2 end
local function sinh(q) return (math.exp(q) - math.exp(-q)) / 2 end
for i = 1, nx do
  for j = 1, layers do
    for l = 1, nz do
      local x, h = (i - 0.5) * a, y[j]
      water:add({ x + off() * a, h + off() * a, (l - 0.5 + off()) * a },
        { velocity = { wave * math.sin(k * x) * cosh(k * h) / cosh(k * low),
          -wave * math.cos(k * x) * sinh(k * h) / cosh(k * low), 0 } })
    end
  end
end
local basin = sim.collider.box { center = {length / 2, 2, width / 2}, half = {length / 2, 2, width / 2},
  inside = true, thickness = a / 4 }

-- The hull: a deck with a bow, and a smaller bottom under it.
local deck = { {-0.18, 0.1}, {0.1, 0.1}, {0.24, 0}, {0.1, -0.1}, {-0.18, -0.1} }
local high, bottom = 0.13, 0.65  -- m; the size of the bottom to that of the deck
local points, triangles = {}, {}
for _, p in ipairs(deck) do points[#points + 1] = { p[1], high / 2, p[2] } end
for _, p in ipairs(deck) do points[#points + 1] = { bottom * p[1], -high / 2, bottom * p[2] } end
for i = 0, 4 do
  local j = (i + 1) % 5
  triangles[#triangles + 1] = { i, i + 5, j + 5 }
  triangles[#triangles + 1] = { i, j + 5, j }
  if i > 0 and i < 4 then
    triangles[#triangles + 1] = { 0, i, j }
    triangles[#triangles + 1] = { 5, j + 5, i + 5 }
  end
end
local boat = sim.rigid { shape = sim.mesh { points = points, triangles = triangles },
  density = boat_density, position = {0.42 * length, depth + high / 2 + 0.01, width / 2} }
local barrel = sim.rigid { shape = sim.capsule { radius = 0.06, length = 0.08 },
  density = barrel_density, position = {0.82 * length, depth + 0.07, 0.6 * width}, rotation = {1.5, 0, 0} }
local stone = sim.rigid { shape = sim.sphere { radius = 0.05 }, density = stone_density,
  position = {0.1 * length, depth + 0.06, 0.5 * width} }
local bodies = { boat, barrel, stone }

return sim.scene { name = "boat", particles = water, bodies = bodies, colliders = { basin },
  forces = { sim.force.gravity {},
    sim.force.fluid { density = 1000, speed_of_sound = sound, alpha = 0.1, boundary = { basin },
      bodies = bodies } },
  observe = {
    boat = function(s) return s:body(0).position[2] end,
    barrel = function(s) return s:body(1).position[2] end,
    stone = function(s) return s:body(2).position[2] end },
  look = { eye = {1.5, 1, 1.6} },
  integrator = "verlet", dt = 0.2 * 1.5 * a / sound, duration = 3 }
