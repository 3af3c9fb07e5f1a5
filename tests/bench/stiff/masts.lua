-- A net of soft cables between stiff masts: 5 x 5 posts of stiff springs, each of 8 knots, stand on
-- the ground, stayed by cables to their neighbours.
local sim = require "sim"
local posts = sim.arg("posts", 5, "masts a side")
local stiffness = sim.arg("stiffness", 1e6, "of the masts, N/m")
local cable = sim.arg("cable", 200, "of the cables, N/m")
local knots, step = 8, 0.25
local net = sim.particles { mass = 0.1 }
local id = {}
for i = 0, posts - 1 do
  for j = 0, posts - 1 do
    for k = 0, knots - 1 do
      id[(i * posts + j) * knots + k] = net:add { i, step * k, j }
    end
    net:pin(id[(i * posts + j) * knots])
  end
end
local masts = sim.force.spring { family = "mast", stiffness = stiffness }
local cables = sim.force.spring { family = "cable", stiffness = cable }
for i = 0, posts - 1 do
  for j = 0, posts - 1 do
    local base = (i * posts + j) * knots
    for k = 1, knots - 1 do masts:tie(id[base + k - 1], id[base + k]) end
    for k = 2, knots - 1, 2 do
      if i + 1 < posts then cables:tie(id[base + k], id[base + posts * knots + k]) end
      if j + 1 < posts then cables:tie(id[base + k], id[base + knots + k]) end
    end
  end
end
return sim.scene { name = "masts", particles = net,
  forces = { sim.force.gravity { g = {1, -9.81, 0.5} }, sim.force.drag { k = 0.05 }, masts, cables },
  integrator = "imex", dt = 0.005, duration = 2 }
