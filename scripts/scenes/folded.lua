-- A box falls on a cloth that lies folded in three layers on the ground.
local sim = require "sim"
local n = sim.arg("n", 20, "particles a side")
local mass = sim.arg("mass", 0.5, "of the box, kg")
local height = sim.arg("height", 0.4, "from which it falls, m")
local friction = sim.arg("friction", 0.4, "of cloth, box and ground")
local k = sim.arg("stiffness", 200, "of the structural springs, N/m")
local thickness = sim.arg("thickness", 0.2 / n, "that layers keep from each other, m")
local s, m = 1 / n, 0.3 / (n * n)

-- The cloth runs to and fro along x, in half circles between its three legs.
local bend = 2 * s / math.pi
local leg = (1 - 2 * s * 2) / 3
local function profile(u)
  local i = math.min(2, math.floor(u / (leg + 2 * s)))
  local r = u - i * (leg + 2 * s)
  local turn = math.max(0, r - leg) / bend
  local x = math.min(r, leg) + bend * math.sin(turn)
  return (i % 2 == 0 and x or leg - x) - leg / 2, 2 * bend * i + bend * (1 - math.cos(turn))
end

local cloth = sim.particles { mass = m }
for i = 0, n - 1 do
  local x, y = profile(i * s)
  for j = 0, n - 1 do cloth:add { x, y + thickness, j * s - 0.5 } end
end
local triangles, springs = {}, {}
local function tie(name, stiffness, offsets)
  local family = sim.force.spring { family = name, stiffness = stiffness, damping = 2 * m }
  for i = 0, n - 1 do
    for j = 0, n - 1 do
      for _, by in ipairs(offsets) do
        local a, b = i + by[1], j + by[2]
        if a < n and b >= 0 and b < n then
          family:tie(i * n + j, a * n + b, { rest = s * math.sqrt(by[1]^2 + by[2]^2) })
        end
      end
    end
  end
  springs[#springs + 1] = family
end
tie("structural", k, { {0,1}, {1,0} })
tie("shear", k / 2, { {1,1}, {1,-1} })
tie("flex", k / 40, { {0,2}, {2,0} })
for i = 0, n - 2 do
  for j = 0, n - 2 do
    local a = i * n + j
    triangles[#triangles + 1] = { a, a + 1, a + n }
    triangles[#triangles + 1] = { a + 1, a + n + 1, a + n }
  end
end

local box = sim.rigid { shape = sim.box { half = {0.12, 0.06, 0.1} }, mass = mass,
  friction = friction, position = {0.02, height, 0.01}, rotation = {0.1, 0.4, 0.15} }

return sim.scene { name = "folded", particles = cloth, bodies = { box },
  contact = sim.contact { surfaces = { sim.surface { particles = cloth, triangles = triangles } },
    thickness = thickness, friction = friction },
  colliders = { sim.collider.plane { point = {0, 0, 0}, friction = friction } },
  forces = { sim.force.gravity {}, sim.force.drag { k = 0.5 * m }, springs[1], springs[2], springs[3] },
  observe = { box = function(q) return q:body(0).position[2] end },
  -- omega^2 of the fastest mode is at most 8 times the sum of the stiffnesses over m.
  integrator = "verlet", dt = math.min(0.0005, 0.2 / math.sqrt(k / m)), duration = 1.5 }
