-- A box falls on a cloth that is held by its corners.
local sim = require "sim"
local n = sim.arg("n", 20, "particles a side")
local mass = sim.arg("mass", 0.2, "of the box, kg")
local height = sim.arg("height", 0.3, "from which it falls, m")
local friction = sim.arg("friction", 0.4, "of the box")
local k = sim.arg("stiffness", 400, "of the structural springs, N/m")
local a, m = 1 / (n - 1), 0.3 / (n * n)

local cloth = sim.grid { n, n, origin = {-0.5, 0, -0.5}, du = {a, 0, 0}, dv = {0, 0, a}, mass = m }
cloth:pin(cloth:id(0, 0), cloth:id(0, n - 1), cloth:id(n - 1, 0), cloth:id(n - 1, n - 1))
local function springs(family, stiffness, offsets)
  return sim.force.spring { family = family, stiffness = stiffness, damping = 0.02,
    grid = cloth, offsets = offsets }
end

local box = sim.rigid { shape = sim.box { half = {0.12, 0.06, 0.09} }, mass = mass, friction = friction,
  position = {0.03, height, 0.02}, rotation = {0.1, 0.4, 0.1} }

return sim.scene { name = "hammock", particles = cloth, bodies = { box },
  forces = { sim.force.gravity {}, sim.force.drag { k = 2 * m },
    springs("structural", k, { {0,1}, {1,0} }),
    springs("shear", k / 2, { {1,1}, {1,-1} }),
    springs("flex", k / 4, { {0,2}, {2,0} }) },
  observe = { box = function(s) return s:body(0).position[2] end },
  -- omega^2 of the fastest mode is at most 8 times the sum of the stiffnesses over m.
  integrator = "verlet", dt = math.min(0.001, 0.15 / math.sqrt(k / m)), duration = 2 }
