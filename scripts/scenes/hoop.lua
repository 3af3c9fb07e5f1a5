-- A bead on a hoop that turns about the vertical: above omega^2 R = g it climbs out of the bottom.
local sim = require "sim"

local omega = sim.arg("omega", 5, "rad/s")
local radius, angle = sim.arg("radius", 1, "m"), sim.arg("angle", 1, "rad, from the bottom")

local bead = sim.particles { mass = 0.5 }
bead:add({ radius * math.sin(angle), -radius * math.cos(angle), 0 },
  { velocity = { 0, 0, omega * radius * math.sin(angle) } })

local hoop = sim.constraint.on_circle { particles = {0}, radius = radius,
  axis = function(t) return { -math.sin(omega * t), 0, math.cos(omega * t) } end }

return sim.scene { name = "hoop", particles = bead,
  forces = { sim.force.gravity { g = {0, -9.81, 0} } }, constraints = { hoop },
  observe = { height = function(s) return radius + s:position(0)[2] end },
  integrator = "rk4", dt = 0.005, duration = 5 }
