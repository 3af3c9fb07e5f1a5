-- A beam of length 10 sides, held at its left end, bends under its weight; by finite elements.
-- Beam theory (Timoshenko): the tip sinks by w L^4 / (8 E I) + w L^2 / (2 k G A), w = density g A,
-- I = A^2 / 12, k = 5/6. Cells of order 1 are too stiff where few lie on top of each other: compare
--   sim scenes/beam.lua --observe=tip.csv -s order=1 -s cells=1
-- The drag is there to bring it to rest.
local sim = require "sim"
local cells = sim.arg("cells", 1, "cells through the height")
local order = sim.arg("order", 2, "of a cell: 1 linear, 2 quadratic")
local young = sim.arg("young", 5e6, "Young's modulus, Pa")
local side, length, density, g = 0.1, 1, 200, 9.81
local n = cells * order
local a = side / n

local block = sim.grid { 10 * n + 1, n + 1, n + 1, du = {a, 0, 0}, dv = {0, a, 0}, dw = {0, 0, a} }
for j = 0, n do
  for k = 0, n do block:pin(block:id(0, j, k)) end
end
local body = sim.force.fem { cells = sim.cells { grid = block, order = order },
  young = young, poisson = 0.3, density = density, model = sim.arg("model", "corotated", "neo_hookean, corotated or stvk") }

local shear, w = young / 2.6, density * g * side^2
local theory = w * length^4 / (8 * young * side^4 / 12) + w * length^2 / (2 * 5 / 6 * shear * side^2)
-- A wave crosses a step of the grid in a / speed.
local speed = math.sqrt(young / density)
return sim.scene { name = "beam", particles = block,
  forces = { body, sim.force.gravity { g = {0, -g, 0} },
    sim.force.drag { k = sim.arg("drag", 40, "kg/s, of the whole beam") / ((10 * n + 1) * (n + 1)^2) } },
  -- the sag of the tip over that of beam theory
  observe = { tip = function(s) return -s:position(block:id(10 * n, 0, 0))[2] / theory end },
  integrator = "verlet", dt = 0.2 * a / speed, duration = 1.5 }
