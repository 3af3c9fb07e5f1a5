-- The sun, Jupiter and a Trojan: three bodies that attract each other, at the corners of a triangle
-- of equal sides, which turns as one (Lagrange 1772). In astronomical units, years and solar masses.
local sim = require "sim"
local jupiter = sim.arg("jupiter", 9.55e-4, "mass of Jupiter, solar masses")
local trojan = sim.arg("trojan", 1e-6, "mass of the Trojan, solar masses")
local side = sim.arg("side", 5.2, "of the triangle, AU")
local G = 4 * math.pi^2  -- AU^3 / (solar mass year^2)

local masses = { 1, jupiter, trojan }
local corners = { {0, 0}, {side, 0}, {side / 2, -side * math.sqrt(3) / 2} }  -- x and z
local all, center = 0, {0, 0}
for k = 1, 3 do
  all = all + masses[k]
  for axis = 1, 2 do center[axis] = center[axis] + masses[k] * corners[k][axis] end
end
local omega = math.sqrt(G * all / side^3)

-- Where the bodies are at time t, about their center of mass; velocities are omega y x.
local function places(t)
  local list = {}
  for k = 1, 3 do
    local x, z = corners[k][1] - center[1] / all, corners[k][2] - center[2] / all
    local c, s = math.cos(omega * t), math.sin(omega * t)
    list[k] = { c * x + s * z, 0, c * z - s * x }
  end
  return list
end

local planets = sim.particles {}
for k, p in ipairs(places(0)) do
  planets:add(p, { mass = masses[k], velocity = { omega * p[3], 0, -omega * p[1] } })
end
return sim.scene { name = "planets", particles = planets, exact = places,
  forces = { sim.force.expression { "-G*m1*m2/r", G = G } },
  integrator = "yoshida4", dt = 0.02, duration = 30 }
