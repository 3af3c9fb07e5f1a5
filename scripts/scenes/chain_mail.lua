-- Chain mail falls over a ball: each ring runs through four others, and nothing else holds it.
-- Rings of a row lie side by side, and rows lean to alternate sides. A ring is a compound of capsules.
local sim = require "sim"
local n = sim.arg("n", 4, "rings of a row; there are 4 n rows")
local sides = sim.arg("sides", 12, "capsules of a ring")
local friction = sim.arg("friction", 0.3, "of rings, the ball and the floor")
local tolerance = sim.arg("tolerance", 1e-4, "of contact, of the velocities at hand")

local radius = 0.05  -- m, of the center line of the wire
local wire, lean = radius / 7, math.rad(30)
local along, across = 2.536 * radius, 0.65 * radius  -- m, from ring to ring, and from row to row

local inner, length = radius * math.cos(math.pi / sides), 2 * radius * math.sin(math.pi / sides)
local parts = {}
for k = 1, sides do
  local angle = 2 * math.pi * k / sides
  parts[k] = { sim.capsule { radius = wire, length = length },
    at = { inner * math.cos(angle), inner * math.sin(angle), 0 }, rotation = { 0, 0, angle } }
end
local ring = sim.compound(parts)

local rows, ball, bodies = 4 * n, 0.03 * n, {}
for row = 1, rows do
  local side = row % 2 == 0 and 1 or -1
  for column = 1, n do
    bodies[#bodies + 1] = sim.rigid { shape = ring, density = 7800, friction = friction,
      position = { (column - 0.5 * (n + 1) + 0.25 * side) * along, ball + 0.8 * radius,
        (row - 0.5 * (rows + 1)) * across },
      rotation = { 0.5 * math.pi + side * lean, 0, 0 } }
  end
end
return sim.scene { name = "chain_mail", bodies = bodies,
  colliders = { sim.collider.sphere { radius = ball, friction = friction },
    sim.collider.plane { point = {0, -2.5 * ball, 0}, friction = friction } },
  forces = { sim.force.gravity {} }, contact = sim.contact.bodies { tolerance = tolerance },
  integrator = "verlet", dt = 0.005, duration = 1 }
