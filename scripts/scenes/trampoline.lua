-- A net of stretched cables in a frame, and a ball that jumps on it.
local sim = require "sim"
local n = sim.arg("n", 24, "meshes a side")
local stretch = sim.arg("stretch", 0.1, "of the cables at the start")
local k = sim.arg("stiffness", 4000, "of each cable, N/m")
local drop = sim.arg("drop", 1, "of the ball above the net, m")
local mass = sim.arg("mass", 5, "of the ball, kg")

local s, radius = 2 / n, 0.25
local net = sim.grid { n + 1, n + 1, origin = {-1, 0, -1}, du = {0, 0, s}, dv = {s, 0, 0},
  mass = 4 / (n + 1)^2 }
for i = 0, n do
  net:pin(net:id(i, 0), net:id(i, n), net:id(0, i), net:id(n, i))
end
local ball = sim.rigid { shape = sim.sphere { radius = radius }, mass = mass,
  position = {0, drop + radius, 0} }

return sim.scene { name = "trampoline", particles = net, bodies = { ball },
  forces = { sim.force.gravity {},
    sim.force.spring { family = "cable", stiffness = k, rest = s / (1 + stretch),
      tension_only = true, grid = net, offsets = { {0, 1}, {1, 0} } } },
  observe = { height = function(s) return s:body(0).position[2] - radius end },
  integrator = "verlet", dt = 0.0001, duration = 2 }
