-- A napkin that is drawn through a ring by its middle, and never through itself.
local sim = require "sim"
local n = sim.arg("n", 17, "particles a side")
local radius = sim.arg("radius", 0.16, "of the ring, m")
local friction = sim.arg("friction", 0.1, "of the cloth on itself and the ring")
local speed = sim.arg("speed", 0.8, "of the draw, m/s")
local k = sim.arg("stiffness", 400, "of the structural springs, N/m")
local thickness = sim.arg("thickness", math.min(0.08 / n, 0.006), "that layers keep from each other, m")
local s, m = 1 / n, 0.2 / (n * n)
local half = 0.5 * (n - 1) * s

local wire = 0.02
local cloth = sim.grid { n, n, origin = {-half, wire + 2 * thickness, -half}, du = {0,0,s}, dv = {s,0,0}, mass = m }
local function springs(family, stiffness, offsets)
  return sim.force.spring { family = family, stiffness = stiffness, grid = cloth, offsets = offsets,
    damping = 0.02 * math.sqrt(k * m) }
end

-- The ring is a surface of pinned particles, so that its finest parts are felt between those of the
-- cloth, too.
local around, tube, ring = 24, 8, {}
for i = 0, around - 1 do
  for j = 0, tube - 1 do
    local a, b = 2 * math.pi * i / around, 2 * math.pi * j / tube
    local r = radius + wire * math.cos(b)
    local id = cloth:add({ r * math.cos(a), wire * math.sin(b), r * math.sin(a) }, { mass = m })
    cloth:pin(id)
    ring[i * tube + j] = id
  end
end
local faces = {}
local function corner(i, j) return ring[(i % around) * tube + j % tube] end
for i = 0, around - 1 do
  for j = 0, tube - 1 do
    faces[#faces + 1] = { corner(i, j), corner(i, j + 1), corner(i + 1, j + 1) }
    faces[#faces + 1] = { corner(i, j), corner(i + 1, j + 1), corner(i + 1, j) }
  end
end

-- The middle starts and stops softly.
local way = sim.arg("way", 0.9, "that the middle is drawn, m")
local middle = cloth:id(n // 2, n // 2)
local x0, y0, z0 = s * (n // 2) - half, wire + 2 * thickness, s * (n // 2) - half
local last = way / speed + 0.3
cloth:prescribe(middle, function(t)
  local u = math.max(0, math.min(1, t / last))
  local down, slope = u * u * u * (10 - 15 * u + 6 * u * u), 30 * u * u * (1 - u) ^ 2
  return { x0, y0 - way * down, z0 }, { 0, -way * slope / last, 0 }
end)

return sim.scene { name = "ring", particles = cloth,
  contact = sim.contact { thickness = thickness, friction = friction,
    surfaces = { sim.surface { grid = cloth },
      sim.surface { particles = cloth, triangles = faces } } },
  forces = { sim.force.gravity { g = {0, -9.81, 0} }, sim.force.drag { k = m },
    springs("structural", k, { {0,1}, {1,0} }),
    springs("shear", k / 2, { {1,1}, {1,-1} }),
    springs("flex", k / 100, { {0,2}, {2,0} }) },
  -- omega^2 of the fastest mode is at most 8 times the sum of the stiffnesses over m.
  integrator = "verlet", dt = math.min(0.004, 0.1 / math.sqrt(k / m)), duration = last + 0.3 }
