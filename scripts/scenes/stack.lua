-- Boxes one on the other, at rest on the ground.
local sim = require "sim"
local n = sim.arg("n", 10, "boxes")
local friction = sim.arg("friction", 0.5, "of the boxes and the ground")
local lean = sim.arg("lean", 0, "m, how far each box is from the middle of the one below")

local bodies = {}
for i = 1, n do
  bodies[i] = sim.rigid { shape = sim.box { half = {0.5, 0.5, 0.5} }, mass = 1,
    position = { lean * (i - 1), i - 0.5, 0 }, friction = friction }
end
local ground = sim.collider.plane { normal = {0, 1, 0}, friction = friction }
return sim.scene { name = "stack", bodies = bodies, colliders = { ground },
  forces = { sim.force.gravity {} },
  observe = { top = function(s) return s:body(n - 1).position[2] - (n - 0.5) end },
  integrator = "verlet", dt = 0.002, duration = 10 }
