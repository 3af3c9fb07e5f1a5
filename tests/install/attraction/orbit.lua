-- One particle of 2 kg about (0, 1, 0): omega = 5 rad/s, half axes of 3 m and 1 m.
local sim = require "sim"
local bead = sim.particles { mass = 2 }
bead:add({ 3, 1, 0 }, { velocity = { 0, 0, 5 } })
return sim.scene { name = "orbit", particles = bead, integrator = "rk4", dt = 0.001, duration = 1,
  forces = { sim.force.attraction { k = 50, center = { 0, 1, 0 } } } }
