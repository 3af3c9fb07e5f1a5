-- A rope of rigid links, let go at one end: no stretch, and steps as long as its swing allows.
local sim = require "sim"

local n = sim.arg("n", 20, "links")
local length, mass = sim.arg("length", 1, "m"), sim.arg("mass", 0.1, "kg")
local springs = sim.arg("stiffness", 0, "N/m; above 0 links are springs of that stiffness instead")

local rope = sim.particles { mass = mass / n }
for i = 0, n do rope:add { length * i / n, 0, 0 } end
rope:pin(0)

local ties = {}
for i = 1, n do ties[i] = { i - 1, i } end
local rods = springs == 0 and { sim.constraint.distance { ties = ties, length = length / n } } or nil
local forces = { sim.force.gravity { g = {0, -9.81, 0} } }
if springs > 0 then
  forces[2] = sim.force.spring { family = "link", stiffness = springs, ties = ties }
end

return sim.scene { name = "rope", particles = rope, forces = forces, constraints = rods,
  observe = { tip = function(s) return s:position(n)[2] end },
  integrator = "verlet", dt = 0.002, duration = 1 }
