-- Beads in a double well, U = depth ((x/a)^2 - 1)^2 + k/2 (y^2 + z^2), coupled to their neighbours
-- by Morse bonds that can break: two forces written as formulas. Wells hold a bead that has less
-- than `depth`; watch which beads cross.
local sim = require "sim"
local n = sim.arg("n", 8, "beads")
local depth = sim.arg("depth", 2, "energy of the barrier between the wells, J")
local bond = sim.arg("bond", 0.5, "energy that breaks a bond, J")

local beads = sim.particles { mass = 0.1 }
for i = 0, n - 1 do
  beads:add({ -1, 0.4 * i, 0 }, { velocity = { i == 0 and 8 or 0, 0, 0 } })
end

local wells = sim.force.expression { "depth*((x/a)^2 - 1)^2 + 0.5*k*z^2", depth = depth, a = 1,
  k = 20 }
local bonds = sim.force.expression { "bond*(1 - exp(-alpha*(r - rest)))^2", bond = bond,
  alpha = 4 }
for i = 1, n - 1 do bonds:tie(i - 1, i) end

return sim.scene { name = "double_well", particles = beads, forces = { wells, bonds },
  integrator = "verlet", dt = 0.0025, duration = 10 }
