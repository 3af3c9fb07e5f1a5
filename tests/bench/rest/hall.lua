-- A hall of cloths that hang straight at rest, one of which is moved; sleep = 0: all take all steps.
local sim = require "sim"
local count = sim.arg("count", 100, "cloths")
local n = sim.arg("n", 16, "particles a side")
local sleep = sim.arg("sleep", 1e-9, "kinetic energy below which a cloth sleeps, J; 0 = never")
local s, mass = 1 / n, 1 / (n * n)
local particles = sim.particles { mass = mass }
local structural = sim.force.spring { family = "structural", stiffness = 100 }
local shear = sim.force.spring { family = "shear", stiffness = 50 }
local offsets = { {0, 1, structural}, {1, 0, structural}, {1, 1, shear}, {1, -1, shear} }
for cloth = 0, count - 1 do
  local id = {}
  for i = 0, n - 1 do
    for j = 0, n - 1 do
      local moved = cloth == 0 and i == n - 1
      id[i * n + j] = particles:add({ s * j, -s * i, cloth },
        { velocity = { 0, 0, moved and 2 or 0 } })
      if i == 0 then particles:pin(id[i * n + j]) end
    end
  end
  for i = 0, n - 1 do
    for j = 0, n - 1 do
      for _, offset in ipairs(offsets) do
        local a, b = i + offset[1], j + offset[2]
        if a < n and b >= 0 and b < n then offset[3]:tie(id[i * n + j], id[a * n + b]) end
      end
    end
  end
end
local scene = { name = "hall", particles = particles, forces = { structural, shear },
  integrator = "verlet", dt = 0.002, duration = 10 }
if sleep > 0 then scene.sleep = sleep end
return sim.scene(scene)
