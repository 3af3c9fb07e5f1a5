-- A pendulum that stands on its head: its pivot shakes fast enough, (a w)^2 > 2 g l (Kapitza 1951).
local sim = require "sim"
local length = sim.arg("length", 0.5, "of the rod, m")
local amplitude = sim.arg("amplitude", 0.05, "of the pivot, m")
local period = sim.arg("period", 0.05, "of the pivot, s")
local tilt = sim.arg("tilt", 20, "from upright at the start, degrees")

local a = math.rad(tilt)
local pendulum = sim.particles { mass = 1 }
local pivot = pendulum:add({0, 0, 0})
local bob = pendulum:add({length * math.sin(a), length * math.cos(a), 0})
pendulum:prescribe(pivot, sim.motion.swing { amplitude = {0, amplitude, 0}, period = period,
  phase = math.pi / 2 })

return sim.scene { name = "kapitza", particles = pendulum,
  forces = { sim.force.gravity { g = {0, -9.81, 0} }, sim.force.drag { k = 0.5 } },
  constraints = { sim.constraint.distance { ties = { {pivot, bob} } } },
  integrator = "rk4", dt = math.min(0.001, period / 50), duration = 10 }
