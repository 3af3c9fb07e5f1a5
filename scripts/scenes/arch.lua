-- A round arch of loose stones. It stands if it is at least 0.1075 of its mean radius thick (Milankovitch (1907)).
local sim = require "sim"
local n = sim.arg("n", 15, "stones")
local thickness = sim.arg("thickness", 0.15, "m, of the stones; their mean radius is 1 m")
local friction = sim.arg("friction", 0.8, "of stones and ground")
local tolerance = sim.arg("tolerance", 1e-6, "of contact, of the velocities at hand")

-- The faces of a stone between two angles; its points have odd numbers behind, even ones in front.
local faces = { {0, 4, 2}, {0, 6, 4}, {1, 3, 5}, {1, 5, 7}, {0, 2, 3}, {0, 3, 1}, {2, 4, 5}, {2, 5, 3},
  {4, 6, 7}, {4, 7, 5}, {6, 0, 1}, {6, 1, 7} }
local inner, outer = 1 - 0.5 * thickness, 1 + 0.5 * thickness
local stones = {}
for i = 0, n - 1 do
  local from, to, points = math.pi * i / n, math.pi * (i + 1) / n, {}
  for _, corner in ipairs { {inner, from}, {outer, from}, {outer, to}, {inner, to} } do
    for _, z in ipairs { -0.2, 0.2 } do
      points[#points + 1] = { corner[1] * math.cos(corner[2]), corner[1] * math.sin(corner[2]), z }
    end
  end
  stones[#stones + 1] = sim.rigid { shape = sim.mesh { points = points, triangles = faces }, density = 2000,
    friction = friction }
end
local keystone = n // 2

return sim.scene { name = "arch", bodies = stones,
  colliders = { sim.collider.plane { normal = {0, 1, 0}, friction = friction } },
  contact = sim.contact.bodies { tolerance = tolerance },
  forces = { sim.force.gravity {} },
  observe = { keystone = function(s) return s:body(keystone).position[2] end },
  integrator = "verlet", dt = 0.002, duration = 1 }
