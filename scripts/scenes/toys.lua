-- Toys with corners, tips and edges fall into a cloth that is held by its corners.
local sim = require "sim"
local n = sim.arg("n", 24, "particles a side")
local count = sim.arg("toys", 8, "cubes, balls, jacks, pyramids and sticks")
local mass = sim.arg("mass", 0.1, "of each, kg")
local friction = sim.arg("friction", 0.3, "of cloth and toys")
local k = sim.arg("stiffness", 400, "of the structural springs, N/m")
local a, m = 1 / (n - 1), 0.3 / (n * n)

local cloth = sim.grid { n, n, origin = {-0.5, 0, -0.5}, du = {a, 0, 0}, dv = {0, 0, a}, mass = m }
cloth:pin(cloth:id(0, 0), cloth:id(0, n - 1), cloth:id(n - 1, 0), cloth:id(n - 1, n - 1))
local function springs(family, stiffness, offsets)
  return sim.force.spring { family = family, stiffness = stiffness, damping = 0.02,
    grid = cloth, offsets = offsets }
end

local bar = sim.capsule { radius = 0.008, length = 0.12 }
local h = math.pi / 2
local shapes = {
  sim.box { half = {0.04, 0.04, 0.04} },
  sim.sphere { radius = 0.045 },
  sim.compound { { bar }, { bar, rotation = {h, 0, 0} }, { bar, rotation = {0, 0, h} } },
  sim.mesh { points = { {0.06, 0, 0}, {-0.03, 0, 0.05}, {-0.03, 0, -0.05}, {0, 0.1, 0} },
    triangles = { {0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0} } },
  sim.box { half = {0.006, 0.1, 0.006} },
}
local toys = {}
for i = 1, count do
  -- The golden angle spreads them.
  local angle, r = 2.4 * i, 0.06 * math.sqrt(i % 7)
  toys[i] = sim.rigid { shape = shapes[(i - 1) % #shapes + 1], mass = mass, friction = friction,
    position = { r * math.cos(angle), 0.15 + 0.16 * i, r * math.sin(angle) },
    rotation = { 0.5 * i, 0.7, 0.3 * i } }
end

return sim.scene { name = "toys", particles = cloth, bodies = toys,
  contact = sim.contact { surfaces = { sim.surface { grid = cloth } }, friction = friction,
    thickness = math.min(0.004, 0.1 * a) },
  forces = { sim.force.gravity {}, sim.force.drag { k = 2 * m },
    springs("structural", k, { {0,1}, {1,0} }),
    springs("shear", k / 2, { {1,1}, {1,-1} }),
    springs("flex", k / 4, { {0,2}, {2,0} }) },
  observe = { lowest = function(s)
    local y = s:body(0).position[2]
    for i = 1, count - 1 do y = math.min(y, s:body(i).position[2]) end
    return y
  end },
  -- omega^2 of the fastest mode is at most 8 times the sum of the stiffnesses over m.
  integrator = "verlet", dt = math.min(0.001, 0.15 / math.sqrt(k / m)), duration = 1 }
