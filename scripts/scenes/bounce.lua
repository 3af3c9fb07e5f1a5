-- A row of balls of growing restitution dropped on a plane, and a slanted one that they run down to.
-- Without friction and drag: each bounce gives back its share of the normal velocity.
local sim = require "sim"
local n = sim.arg("n", 6, "balls")
local height = sim.arg("height", 1, "of the drop, m")
local restitution = sim.arg("restitution", 0.8, "of the plane, 0 .. 1")
local slope = sim.arg("slope", 0.2, "of the plane, m/m")

local balls = sim.particles { mass = 0.1 }
for i = 1, n do balls:add({ 0.25 * i, height + slope * 0.25 * i, 0 }, { velocity = { 0, 0, 0.1 * i } }) end

local plane = sim.collider.plane { point = {0, 0, 0}, normal = {-slope, 1, 0}, restitution = restitution }

return sim.scene { name = "bounce", particles = balls,
  forces = { sim.force.gravity { g = {0, -9.81, 0} } }, colliders = { plane },
  integrator = "verlet", dt = 0.005, duration = 5 }
