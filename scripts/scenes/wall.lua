-- A wall of bricks that a ball breaks.
local sim = require "sim"
local rows, columns = sim.arg("rows", 8, "courses of bricks"), sim.arg("columns", 8, "bricks a course")
local speed = sim.arg("speed", 12, "of the ball, m/s")
local tolerance = sim.arg("tolerance", 1e-6, "of contact, of the velocities at hand")

local half = {0.12, 0.035, 0.055}  -- m
local bricks = {}
for row = 0, rows - 1 do
  -- Every other course is set off by half a brick.
  for column = 0, columns - 1 do
    local x = 2 * half[1] * (column - 0.5 * (columns - 1) + 0.25 * (row % 2 == 0 and 1 or -1))
    bricks[#bricks + 1] = sim.rigid { shape = sim.box { half = {half[1] - 0.001, half[2], half[3]} },
      density = 1800, friction = 0.6, position = { x, half[2] * (2 * row + 1), 0 } }
  end
end
bricks[#bricks + 1] = sim.rigid { shape = sim.sphere { radius = 0.1 }, density = 4000, friction = 0.4,
  restitution = 0.2, position = { 0, 0.6 * rows * 2 * half[2], 0.5 }, velocity = { 0, 0, -speed } }

return sim.scene { name = "wall", bodies = bricks,
  colliders = { sim.collider.plane { normal = {0, 1, 0}, friction = 0.6 } },
  contact = sim.contact.bodies { tolerance = tolerance },
  forces = { sim.force.gravity {} },
  observe = { ball = function(s) return s:body(#bricks - 1).position[3] end },
  integrator = "verlet", dt = 0.002, duration = 1 }
