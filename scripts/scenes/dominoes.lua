-- A row of dominoes; the first one is pushed over.
local sim = require "sim"
local n = sim.arg("n", 12, "dominoes")
local spacing = sim.arg("spacing", 0.026, "m, from one to the next")
local push = sim.arg("push", 4, "rad/s, of the first one about its foot")
local tolerance = sim.arg("tolerance", 1e-6, "of contact, of the velocities at hand")

local half = {0.00375, 0.024, 0.012}  -- m
local dominoes = {}
for i = 0, n - 1 do
  local turn = i == 0 and push or 0
  dominoes[#dominoes + 1] = sim.rigid { shape = sim.box { half = half }, mass = 0.0089, friction = 0.3,
    position = { spacing * i, half[2], 0 }, velocity = { turn * half[2], 0, 0 }, angular_velocity = { 0, 0, -turn } }
end

-- How many lean by more than 0.2 rad.
local function fallen(s)
  local count = 0
  for i = 0, n - 1 do
    if math.abs(s:body(i).rotation[4]) > 0.1 then count = count + 1 end
  end
  return count
end

return sim.scene { name = "dominoes", bodies = dominoes,
  colliders = { sim.collider.plane { normal = {0, 1, 0}, friction = 0.5 } },
  contact = sim.contact.bodies { tolerance = tolerance },
  forces = { sim.force.gravity {} },
  observe = { fallen = fallen },
  integrator = "verlet", dt = 0.001, duration = 1 }
