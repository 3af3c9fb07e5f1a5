-- One particle on a spring to a fixed point, falling sideways: the smallest second-order scene.
-- Watch the energy: without drag it must stay, and how well it stays is the integrator's doing.
local sim = require "sim"
local length = sim.arg("length", 1, "rest length of the spring, m")
local stiffness = sim.arg("stiffness", 100, "of the spring, N/m")
local mass = sim.arg("mass", 1, "of the particle, kg")
local drag = sim.arg("drag", 0, "of the particle, kg/s")

local pendulum = sim.particles { mass = mass }
local hook = pendulum:add { 0, 0, 0 }
local bead = pendulum:add { length, 0, 0 }
pendulum:pin(hook)

local spring = sim.force.spring { family = "link", stiffness = stiffness }
spring:tie(hook, bead)

local forces = { sim.force.gravity { g = {0, -9.81, 0} }, spring }
if drag ~= 0 then forces[#forces + 1] = sim.force.drag { k = drag } end

return sim.scene { name = "pendulum1", particles = pendulum, forces = forces,
  integrator = "rk4", dt = 0.005, duration = 10 }
