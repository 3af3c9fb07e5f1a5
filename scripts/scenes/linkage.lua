-- Rigid pieces at work: a welded triangle hangs from a rod, and a bead on a helix from its corner.
local sim = require "sim"

local bodies = sim.particles { mass = 0.2 }
bodies:add { 0, 0, 0 }
for _, corner in ipairs { {0.5, 0, 0}, {0.8, 0.1, 0}, {0.7, -0.3, 0.1} } do bodies:add(corner) end
bodies:add { 1, 0, 0 }
bodies:pin(0)

local function helix(s) return { math.cos(s), s / 5, math.sin(s) } end

return sim.scene { name = "linkage", particles = bodies,
  forces = { sim.force.gravity { g = {0, -9.81, 0} },
    sim.force.spring { stiffness = 20, ties = { {2, 4} } } },
  constraints = { sim.constraint.distance { ties = { {0, 1} } },
    sim.constraint.weld { particles = {1, 2, 3} },
    sim.constraint.on_curve { particles = {4}, curve = helix } },
  integrator = "rk4", dt = 0.002, duration = 2 }
