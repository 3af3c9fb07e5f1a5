-- A pile of n x n x n boxes, a little apart and askew, that falls together.
local sim = require "sim"
local n = sim.arg("n", 3, "boxes a side")
local tolerance = sim.arg("tolerance", 1e-12, "of contact, of the velocities at hand")

local bodies = {}
for i = 0, n - 1 do
  for j = 0, n - 1 do
    for k = 0, n - 1 do
      bodies[#bodies + 1] = sim.rigid { shape = sim.box { half = {0.1, 0.1, 0.1} }, mass = 1,
        position = { 0.3 * i + 0.013 * j, 0.15 + 0.25 * j, 0.3 * k + 0.007 * j }, friction = 0.5 }
    end
  end
end
local ground = sim.collider.plane { normal = {0, 1, 0}, friction = 0.5 }
return sim.scene { name = "pile", bodies = bodies, colliders = { ground },
  contact = sim.contact.bodies { tolerance = tolerance },
  forces = { sim.force.gravity {} },
  observe = { top = function(s) return s:body(#bodies - 1).position[2] end },
  integrator = "verlet", dt = 0.005, duration = 2 }
