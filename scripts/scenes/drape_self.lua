-- A cloth that falls on a sphere and from there, in folds, on the ground, and never through itself.
local sim = require "sim"
local n = sim.arg("n", 24, "particles a side")
local radius = sim.arg("radius", 0.15, "of the sphere, m")
local friction = sim.arg("friction", 0.3, "of the cloth on itself, the sphere and the ground")
local k = sim.arg("stiffness", 200, "of the structural springs, N/m")
local thickness = sim.arg("thickness", 0.2 / n, "that layers keep from each other, m")
local s, m = 1 / n, 1 / (n * n)

local cloth = sim.grid { n, n, origin = {-0.5, radius + 2 * thickness, -0.45}, du = {0,0,s}, dv = {s,0,0}, mass = m }
local skin = sim.surface { grid = cloth }
local function springs(family, stiffness, offsets)
  return sim.force.spring { family = family, stiffness = stiffness, grid = cloth, offsets = offsets,
    damping = 0.02 * m / 1e-3 }
end

return sim.scene { name = "drape_self", particles = cloth,
  contact = sim.contact { surfaces = { skin }, thickness = thickness, friction = friction },
  colliders = {
    sim.collider.sphere { radius = radius, center = {0, 0, 0}, friction = friction, thickness = thickness },
    sim.collider.plane { point = {0, -radius - 0.1, 0}, normal = {0, 1, 0}, friction = friction } },
  forces = { sim.force.gravity { g = {0, -9.81, 0} }, sim.force.drag { k = 0.5 * m },
    springs("structural", k, { {0,1}, {1,0} }),
    springs("shear", k / 2, { {1,1}, {1,-1} }),
    springs("flex", k / 40, { {0,2}, {2,0} }) },
  -- omega^2 of the fastest mode is at most 8 times the sum of the stiffnesses over m.
  integrator = "verlet", dt = math.min(0.004, 0.4 / math.sqrt(k / m)), duration = 2 }
