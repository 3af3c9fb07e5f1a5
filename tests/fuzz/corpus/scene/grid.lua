local sim = require "sim"
local g = sim.grid { 3, 3, 2, du = {0.1, 0, 0}, dv = {0, 0.1, 0}, dw = {0, 0, 0.1}, mass = 0.01 }
local skin = sim.surface { grid = g }
local ball = sim.collider.sphere { radius = 0.1, center = {0, -1, 0}, friction = 0.2,
  motion = sim.motion.swing { amplitude = {0, 0.1, 0}, period = 1 } }
return sim.scene { name = "g", particles = g, colliders = { ball }, switches = { ball = ball },
  forces = { sim.force.gravity { g = {0, -9.81, 0} }, sim.force.drag { k = 0.1 },
    sim.force.spring { family = "e", stiffness = 100, grid = g, offsets = { {1,0,0}, {0,1,0}, {0,0,1} } },
    sim.force.pressure { surface = skin, pressure = 2 },
    sim.force.expression { "0.5*k*(r - rest)^2", k = 1, grid = g, offsets = { {1, 1, 0} } } },
  integrator = sim.integrator.verlet {}, dt = 0.001, duration = 0.1 }
