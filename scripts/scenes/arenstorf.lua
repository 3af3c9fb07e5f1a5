-- A satellite of earth and moon whose orbit closes (Arenstorf 1963; Hairer, Norsett & Wanner,
-- Solving ODEs I (1993), section II.0): distances in those of earth and moon, in a frame that turns
-- with them.
local sim = require "sim"
local period = 17.0652165601579625588917206249

return sim.scene { name = "arenstorf", state = { 0.994, 0, 0, -2.00158510637908252240537862224 },
  field = sim.field.formula { "u", "v",
    "x + 2*v - n*(x + m)/earth - m*(x - n)/moon; n = 1 - m; " ..
      "earth = ((x + m)^2 + y^2)^1.5; moon = ((x - n)^2 + y^2)^1.5",
    "y - 2*u - n*y/earth - m*y/moon; n = 1 - m; " ..
      "earth = ((x + m)^2 + y^2)^1.5; moon = ((x - n)^2 + y^2)^1.5",
    names = {"x", "y", "u", "v"}, m = 0.012277471 },
  integrator = sim.integrator.dop853 { tol = 1e-10 }, dt = period / 1000, duration = period }
