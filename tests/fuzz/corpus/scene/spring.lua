local sim = require "sim"
local p = sim.particles { mass = 1 }
local a, b = p:add {0, 0, 0}, p:add {1, 0, 0}
p:pin(a)
local s = sim.force.spring { stiffness = 50, rest = 1, damping = 0.1 }
s:tie(a, b, { stiffness = 20 })
return sim.scene { name = "s", particles = p, forces = { sim.force.gravity {}, s },
  observe = { x = function(s) return s:position(1)[1] end },
  integrator = "rk4", dt = 0.01, duration = 1 }
