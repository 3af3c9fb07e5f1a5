-- A point runs around the unit circle: x' = (-y, x, 0). First order: no velocity, no mass.
-- The exact solution is known, so the error of every integrator and step can be read off.
local sim = require "sim"
return sim.scene { name = "circle", state = { x = { {1, 0, 0} } }, field = sim.field.rotation { omega = 1 },
  integrator = "trapezoid", dt = 0.01, duration = 10,
  exact = function(t) return { {math.cos(t), math.sin(t), 0} } end }
