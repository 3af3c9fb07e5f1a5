-- A block of jelly falls into water and floats.
local sim = require "sim"
local layers = sim.arg("layers", 5, "of particles over the height of the block")
local density = sim.arg("density", 500, "of the block, kg/m^3")
local depth = sim.arg("depth", 0.3, "of the water, m")
local height = sim.arg("height", 0.1, "of the block above the water, m")
local young = sim.arg("young", 20000, "modulus of the block, Pa")
local side, room = 0.2, 0.4

-- Particles of the block are as near to each other as those of the water, so that none passes
-- through. The water feels their surface 0.84 of its spacing outside of them.
local a = side / layers
local inner = side - 2 * 0.84 * a
local m = math.ceil(inner / a)
local b = inner / m
local n, ny = math.floor(room / a + 0.5), math.floor(depth / a + 0.5)
local all = sim.particles {}
local told, water = 0, {}
local function off() told = told + 1; return 0.004 * a * ((told * 0.618034) % 1 - 0.5) end
for i = 1, n do
  for j = 1, ny do
    for k = 1, n do
      water[#water + 1] = all:add({ (i - 0.5) * a + off(), (j - 0.5) * a + off(),
        (k - 0.5) * a + off() }, { mass = 1000 * a^3 })
    end
  end
end
local size, corner = m + 1, room / 2 - inner / 2
local block, cells, skin = #water, {}, {}
local function id(i, j, k) return block + (i * size + j) * size + k end
for i = 0, m do
  for j = 0, m do
    for k = 0, m do
      all:add { corner + i * b, depth + height + 0.84 * a + j * b, corner + k * b }
    end
  end
end
-- Each cube is five tetrahedra, mirrored from one to the next; a face two triangles, seen from outside.
local function cube(i, j, k)
  local function at(x, y, z)
    if (i + j + k) % 2 == 1 then x = 1 - x end
    return id(i + x, j + y, k + z)
  end
  local odd = (i + j + k) % 2 == 1
  local function cell(p, q, r, s)
    cells[#cells + 1] = odd and { p, q, s, r } or { p, q, r, s }
  end
  cell(at(0,0,0), at(1,0,0), at(0,1,0), at(0,0,1))
  cell(at(1,1,0), at(0,1,0), at(1,0,0), at(1,1,1))
  cell(at(1,0,1), at(1,0,0), at(0,0,1), at(1,1,1))
  cell(at(0,1,1), at(0,0,1), at(0,1,0), at(1,1,1))
  cell(at(1,0,0), at(0,1,0), at(0,0,1), at(1,1,1))
end
local function face(p, q, r, s)
  skin[#skin + 1] = { p, q, r }
  skin[#skin + 1] = { p, r, s }
end
for i = 0, m - 1 do
  for j = 0, m - 1 do
    for k = 0, m - 1 do cube(i, j, k) end
    face(id(i, j, 0), id(i, j+1, 0), id(i+1, j+1, 0), id(i+1, j, 0))
    face(id(i, j, m), id(i+1, j, m), id(i+1, j+1, m), id(i, j+1, m))
    face(id(i, 0, j), id(i+1, 0, j), id(i+1, 0, j+1), id(i, 0, j+1))
    face(id(i, m, j), id(i, m, j+1), id(i+1, m, j+1), id(i+1, m, j))
    face(id(0, i, j), id(0, i, j+1), id(0, i+1, j+1), id(0, i+1, j))
    face(id(m, i, j), id(m, i+1, j), id(m, i+1, j+1), id(m, i, j+1))
  end
end

local sound = 10 * math.sqrt(2 * 9.81 * (depth + height))
local walls = sim.collider.box { center = {room/2, 1, room/2}, half = {room/2, 1, room/2},
  inside = true, thickness = a / 4 }
return sim.scene { name = "float", particles = all, colliders = { walls },
  forces = { sim.force.gravity {},
    sim.force.fem { cells = sim.cells { particles = all, tetrahedra = cells }, young = young, poisson = 0.4,
      density = density * (side / inner)^3 },
    sim.force.fluid { particles = water, density = 1000, speed_of_sound = sound, alpha = 0.1,
      boundary = { walls }, solid = sim.surface { particles = all, triangles = skin } } },
  observe = { block = function(s)
    local sum = 0
    for p = block, block + size^3 - 1 do sum = sum + s:position(p)[2] end
    return sum / size^3
  end },
  look = { eye = {1.3, 0.9, 1.6} },
  integrator = "verlet", dt = 0.2 * 1.5 * a / sound, duration = 3 }
