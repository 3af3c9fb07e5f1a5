-- A heavy top: a spindle with a disk that turns on its tip, which a joint holds to a hook.
local sim = require "sim"
local spin = sim.arg("spin", 250, "rad/s, about its axis")
local lean = sim.arg("lean", 0.3, "rad, from upright at the start")

-- A double cone: a ring of 24 points between the tip and the knob, around y.
local points, triangles = { {0, 0, 0}, {0, 0.1, 0} }, {}
for i = 0, 23 do
  local angle = 2 * math.pi * i / 24
  points[i + 3] = { 0.04 * math.cos(angle), 0.06, 0.04 * math.sin(angle) }
  local here, after = i + 2, (i + 1) % 24 + 2
  triangles[2 * i + 1] = { 0, here, after }
  triangles[2 * i + 2] = { 1, after, here }
end
local axis = { math.sin(lean), math.cos(lean), 0 }
local top = sim.rigid { shape = sim.mesh { points = points, triangles = triangles },
  mass = 0.1, rotation = {0, 0, -lean}, angular_velocity = { spin * axis[1], spin * axis[2], 0 } }

local floor = sim.particles {}
local hook = floor:add {0, 0, 0}
floor:pin(hook)
return sim.scene { name = "top", particles = floor, bodies = { top },
  constraints = { sim.constraint.joint { ties = { { top:at {0, 0, 0}, hook } } } },
  forces = { sim.force.gravity {} },
  observe = { height = function(s) return s:body(0).position[2] end },
  integrator = "rk4", dt = 0.0005, duration = 2 }
