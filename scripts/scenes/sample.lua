-- Three systems side by side, each on its own: a point on a circle, a pendulum, and a cloth that a
-- swinging sphere pushes. `sim scenes/sample.lua r 0.005` runs all of them with RK4; energies and
-- dumps go by these names.
local sim = require "sim"
return sim.world {
  circle = require "scenes.circle",
  cloth = require "scenes.cloth_ball",
  pendulum = require "scenes.pendulum",
}
