local sim = require "sim"
return sim.world { a = sim.scene { name = "a", state = { 10, 5 },
  field = sim.field.lua { function(t, x) return { x[1] * (1 - 0.1 * x[2]), x[2] * (0.05 * x[1] - 1) } end },
  integrator = sim.integrator.dopri5 { tol = 1e-6 }, dt = 0.01, duration = 1 },
  b = sim.scene { name = "b", state = { x = { {1, 0, 0} } }, field = sim.field.rotation { omega = sim.arg("w", 1) },
  integrator = "trapezoid", dt = 0.01, duration = 1 } }
