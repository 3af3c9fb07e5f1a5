-- Newton's cradle: balls of steel on strings. As many as fall come off at the other end.
local sim = require "sim"
local n = sim.arg("balls", 5, "")
local fall = sim.arg("fall", 1, "balls that are let go")
local lift = sim.arg("lift", 30, "by how much they are raised, degrees")
local gap = sim.arg("gap", 1e-6, "between balls at rest, m")

local radius, length = 0.02, 0.2
local ceiling, balls, strings = sim.particles {}, {}, {}
for i = 1, n do
  local x, a = (i - 1) * (2 * radius + gap), i <= fall and math.rad(lift) or 0
  balls[i] = sim.rigid { shape = sim.sphere { radius = radius }, density = 7850, restitution = 1,
    position = { x - length * math.sin(a), -length * math.cos(a), 0 } }
  -- Two strings, so that it stays in its plane.
  for _, z in ipairs { -0.1, 0.1 } do
    local hook = ceiling:add { x, 0, z }
    ceiling:pin(hook)
    strings[#strings + 1] = { balls[i]:at {0, 0, 0}, hook }
  end
end

return sim.scene { name = "cradle", particles = ceiling, bodies = balls,
  constraints = { sim.constraint.distance { ties = strings } },
  forces = { sim.force.gravity {} },
  observe = {
    first = function(s) return s:body(0).position[1] end,
    last = function(s) return s:body(n - 1).position[1] end },
  integrator = "rk4", dt = 0.001, duration = 3 }
