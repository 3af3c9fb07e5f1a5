-- A chain of n beads hung from bead 0, released horizontally, with gravity, springs and drag.
-- With n = 2 it is the single pendulum; more beads make it whip, which asks for small steps.
local sim = require "sim"
local n = sim.arg("n", 4, "beads")
local chain = sim.particles { mass = 1 }                                   -- kg
for i = 0, n - 1 do chain:add { 0.5 * i, 0, 0 } end                        -- m
chain:pin(0)
local links = sim.force.spring { family = "link", stiffness = 200 }        -- N/m; rest = the distance at the start
for i = 1, n - 1 do links:tie(i - 1, i) end
return sim.scene { name = "pendulum", particles = chain,
  forces = { sim.force.gravity { g = {0, -9.81, 0} }, sim.force.drag { k = 0.5 }, links },
  observe = { sag = function(s) return s:position(n - 1)[2] end },         -- m, of the last bead
  integrator = "rk4", dt = 0.005, duration = 10 }
