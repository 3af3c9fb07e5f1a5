-- A soft jelly of springs with a stiff skin around it, held at one side.
local sim = require "sim"
local n = sim.arg("n", 8, "particles an edge")
local core = sim.arg("core", 100, "stiffness within, N/m")
local skin = sim.arg("skin", 1e5, "stiffness of the skin, N/m")
local s, m = 1 / (n - 1), 1 / n ^ 3
local jelly = sim.grid { n, n, n, du = {s, 0, 0}, dv = {0, s, 0}, dw = {0, 0, s}, mass = m }
local inner = sim.force.spring { family = "core", stiffness = core, grid = jelly,
  offsets = { {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 0}, {1, -1, 0}, {0, 1, 1}, {0, 1, -1},
              {1, 0, 1}, {1, 0, -1} } }
local outer = sim.force.spring { family = "skin", stiffness = skin }
local function at(i, j, k) return jelly:id(i, j, k) end
local function outside(i, j, k)
  return i == 0 or j == 0 or k == 0 or i == n - 1 or j == n - 1 or k == n - 1
end
for i = 0, n - 1 do
  for j = 0, n - 1 do
    for k = 0, n - 1 do
      for _, d in ipairs { {1, 0, 0}, {0, 1, 0}, {0, 0, 1} } do
        local a, b, c = i + d[1], j + d[2], k + d[3]
        if a < n and b < n and c < n and outside(i, j, k) and outside(a, b, c) then
          outer:tie(at(i, j, k), at(a, b, c))
        end
      end
    end
  end
end
for j = 0, n - 1 do
  for k = 0, n - 1 do jelly:pin(at(0, j, k)) end
end
return sim.scene { name = "skin", particles = jelly,
  forces = { sim.force.gravity { g = {0, -9.81, 0} }, sim.force.drag { k = m }, inner, outer },
  integrator = "imex", dt = 0.002, duration = 1 }
