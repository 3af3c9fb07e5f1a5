-- A pendulum on a stiff rod, with a second bob on a soft spring; kind = "rod" has a constraint in
-- the place of the stiff spring.
local sim = require "sim"
local stiffness = sim.arg("stiffness", 1e6, "of the rod, N/m")
local kind = sim.arg("kind", "spring", "of the rod: spring or rod")
local bobs = sim.particles { mass = 1 }
local hook = bobs:add { 0, 0, 0 }
local bob = bobs:add { 0.8, -0.6, 0 }
local other = bobs:add { 1.3, -0.6, 0 }
bobs:pin(hook)
local soft = sim.force.spring { family = "soft", stiffness = 50 }
soft:tie(bob, other)
local forces, constraints = { sim.force.gravity { g = {0, -9.81, 0} }, soft }, nil
if kind == "rod" then
  constraints = { sim.constraint.distance { ties = { {hook, bob} } } }
else
  local rod = sim.force.spring { family = "rod", stiffness = stiffness }
  rod:tie(hook, bob)
  forces[#forces + 1] = rod
end
return sim.scene { name = "rod", particles = bobs, forces = forces, constraints = constraints,
  integrator = kind == "rod" and "verlet" or "imex", dt = 0.005, duration = 10 }
