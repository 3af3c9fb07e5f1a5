-- Foucault's pendulum: the plane of its swing turns, once in day / sin(latitude). x is east, y up
-- and z south; the day is short, so that the turning is seen.
local sim = require "sim"
local length = sim.arg("length", 10, "of the string, m")
local start = sim.arg("start", 0.5, "m to the east, from where the bob is let go")
local latitude = sim.arg("latitude", 48.85, "degrees north")
local day = sim.arg("day", 300, "s")

local omega, angle = 2 * math.pi / day, math.rad(latitude)
local pendulum = sim.particles { mass = 28 }
local hook = pendulum:add {0, 0, 0}
local bob = pendulum:add { start, -math.sqrt(length^2 - start^2), 0 }
pendulum:pin(hook)

return sim.scene { name = "foucault", particles = pendulum,
  constraints = { sim.constraint.distance { ties = { {hook, bob} } } },
  forces = { sim.force.gravity {},
    -- Coriolis: -2 m W x v, with W = w (0, sin(latitude), -cos(latitude)).
    sim.force.expression {
      fx = "-2*m*w*(up*vz + north*vy)", fy = "2*m*w*north*vx", fz = "2*m*w*up*vx",
      w = omega, up = math.sin(angle), north = math.cos(angle) } },
  integrator = "rk4", dt = 0.01, duration = 200 }
