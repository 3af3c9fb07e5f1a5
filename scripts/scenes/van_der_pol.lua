-- Van der Pol's oscillator: smooth for mu = 1, and with two very different time scales for mu = 1e6
-- (Hairer & Wanner, Solving ODEs II (1996), section IV.1).
local sim = require "sim"
local mu = sim.arg("mu", 1000, "strength of its damping")

return sim.scene { name = "van_der_pol", state = { 2, 0 },
  field = sim.field.formula { "v", "mu*(1 - x^2)*v - x", names = {"x", "v"}, mu = mu },
  integrator = sim.integrator.bdf { tol = 1e-6 }, dt = mu / 100, duration = 2 * mu }
