-- A rope bridge: two ropes with planks between them, and a load that walks over it. Ropes carry no
-- compression, and break where they are pulled by more than they bear.
local sim = require "sim"
local planks = sim.arg("planks", 24, "between the banks")
local load = sim.arg("load", 80, "that walks over it, kg")
local strength = sim.arg("strength", 6000, "of a rope, N")
local slack = sim.arg("slack", 1.03, "length of a rope over the width of the gorge, nearly")

local width, half, walk = 12, 0.5, 8  -- m, m, s
local step = width / (planks + 1)
local bridge = sim.particles { mass = 4 }
local ropes = sim.force.spring { family = "rope", stiffness = 2e5, damping = 300, tension_only = true,
  break_force = strength }
local boards = sim.force.spring { family = "plank", stiffness = 2e5, damping = 300 }
local before
for i = 0, planks + 1 do
  -- Nearly as it hangs; ropes are as long as they are here.
  local x = i * step
  local sag = width * math.sqrt(3 / 8 * (slack - 1)) * 4 * x / width * (1 - x / width)
  local ends = { bridge:add {x, -sag, -half}, bridge:add {x, -sag, half} }
  if i == 0 or i == planks + 1 then bridge:pin(ends[1], ends[2]) else boards:tie(ends[1], ends[2]) end
  if before then
    ropes:tie(before[1], ends[1])
    ropes:tie(before[2], ends[2])
  end
  before = ends
end

return sim.scene { name = "bridge", particles = bridge,
  forces = { sim.force.gravity {}, sim.force.drag { k = 4 }, ropes, boards,
    -- The load rests on the planks around it, a share on each: a walker at x = speed t.
    sim.force.expression { fy = "-9.81*load/2*max(0, 1 - abs(x - speed*t)/step)*(m > 0)",
      load = load, speed = width / walk, step = step } },
  integrator = "rk4", dt = 0.0005, duration = 10 }
