-- The scene language. A scene file starts with
--
--   local sim = require "sim"
--
-- and ends with `return sim.scene { ... }` or `return sim.world { ... }`. Units are SI: m, kg, s,
-- N. Vectors are {x, y, z}; particle ids start at 0. All numbers must be finite. Every mistake is
-- an error that names the line, what was expected, and the nearest name that exists.
--
-- This file only builds tables; the kernel reads them once, after the scene file has returned.

local host = ...  -- what the kernel lends: places in the scene, errors, parameters, plugins
local here, fail, suggest, show = host.here, host.fail, host.suggest, host.show
local type, setmetatable, tostring = type, setmetatable, tostring
local next = host.next  -- quick; the order in which it visits entries decides nothing here

-- An old name works for one release; runs note the new one.
local function renamed(old, new) host.renamed((here()), old, new) end
local math_type, select = math.type, select

local MOST = 2 ^ 31 - 1  -- particles of one scene

-- The value given to the scene -> what was said about it. Scenes cannot reach the records.
local records = setmetatable({}, { __mode = "k" })

-- Errors and checks ------------------------------------------------------------------------------

local function bad(what, expected, got, remedy)
  fail((here()), "bad " .. what, "expected " .. expected .. ", got " .. show(got), remedy)
end

local function check_keys(options, known, what)
  if type(options) ~= "table" then bad("argument of " .. what, "a table", options) end
  local unknown
  for key in next, options do
    if not known[key] then
      local name = type(key) == "string" and key or show(key)
      if not unknown or name < unknown then unknown = name end
    end
  end
  if unknown then
    fail((here()), "unknown key '" .. unknown .. "' in " .. what, "it is not used there",
      suggest(unknown, known))
  end
end

-- The three numbers of a vector.
local function vector(v, what)
  if type(v) ~= "table" then bad(what, "a vector {x, y, z}", v) end
  local x, y, z = v[1], v[2], v[3]
  -- x - x is 0 for finite numbers only
  if type(x) == "number" and type(y) == "number" and type(z) == "number"
    and x - x == 0 and y - y == 0 and z - z == 0 then
    local entries = 0
    for _ in next, v do entries = entries + 1 end
    if entries == 3 then return x, y, z end
    fail((here()), "bad " .. what,
      "expected a vector {x, y, z} of 3 numbers, got a table with " .. entries .. " entries")
  end
  for i, axis in ipairs { "x", "y", "z" } do
    local c = v[i]
    if c == nil then
      fail((here()), "bad " .. what, "expected a vector {x, y, z} of 3 finite numbers, " .. axis
        .. " is missing", "write it like {0, 0, 0}")
    end
    if type(c) ~= "number" or c - c ~= 0 then
      bad(what, "a vector {x, y, z} of 3 finite numbers", c)
    end
  end
end

local function number_from(v, least, strict, what, unit)
  if type(v) ~= "number" or v - v ~= 0 or v < least or (strict and v == least) then
    bad(what, "a finite number " .. (strict and "> " or ">= ") .. least .. unit, v)
  end
  return v
end

local function integer_from(v, least, most, what)
  if type(v) == "number" and v >= least and v <= most and v % 1 == 0 then return v // 1 | 0 end
  bad(what, "a whole number from " .. least .. " to " .. (most | 0), v)
end

-- Values with methods: empty tables that cannot be written to.
local function class(kind, methods)
  local name = "sim." .. kind
  setmetatable(methods, { __index = function(_, key)
    fail((here()), "unknown name '" .. tostring(key) .. "' of " .. name,
      "it has methods, called with a colon", suggest(key, methods))
  end })
  return {
    __index = methods,
    __newindex = function(_, key)
      fail((here()), "cannot set '" .. tostring(key) .. "' of " .. name,
        "it is given when it is made, between { and }")
    end,
    __tostring = function() return name end,
    __metatable = name,
  }
end

local function record_of(value, kind, method)
  local record = records[value]
  if record and record.kind == kind then return record end
  local maker = kind == "added_grid" and ":add_grid" or "sim." .. kind
  fail((here()), "bad call of " .. method, "it was not called on what " .. maker .. " returned",
    "write it with a colon, as in name:" .. method .. "(...)")
end

-- Particles --------------------------------------------------------------------------------------

local Particles = {}

-- Names that formulas have for themselves.
local meant = { x = true, y = true, z = true, t = true, r = true, m = true, rest = true, pi = true,
  vx = true, vy = true, vz = true }

-- Particles carry a column of numbers for each name, which formulas of forces read.
local function carry(record, options, known, set)
  local numbers
  for key, value in next, options do
    -- A name that is nearly one of those known is a misspelling of it.
    if not known[key] and type(key) == "string" and type(value) == "number"
      and not suggest(key, known):find("^did you mean") then
      if value - value ~= 0 then bad(key .. " of a particle", "a finite number", value) end
      if not key:find("^[%a_][%w_]*$") or meant[key] then
        bad("name of a number that particles carry",
          "a name such as charge, without a meaning in formulas", key)
      end
      numbers = numbers or {}
      numbers[key] = true
      local column = record.numbers[key]
      if not column then
        column = { place = here(), default = 0, values = {} }
        record.numbers[key] = column
      end
      set(column, value)
    end
  end
  return numbers
end

local function with_numbers(known, numbers)
  if not numbers then return known end
  for key in next, known do numbers[key] = true end
  return numbers
end

local of_particle = { mass = true, velocity = true }

-- id = particles:add({x, y, z}, { mass =, velocity =, NAME = })
--   {x, y, z}   position, m
--   mass        kg, > 0; default: the mass given to sim.particles or sim.grid
--   velocity    {vx, vy, vz}, m/s; default {0, 0, 0}
--   NAME        any other number is carried by the particle: with charge = 2, formulas of
--               sim.force.expression read charge, of a pair charge1 and charge2; default: that of
--               sim.particles or sim.grid, or 0
-- Returns the id: 0, 1, 2, ... in the order of adding (after those of the grid, if it is one).
-- Errors: a position that is not a vector, an unknown option, a bad value, a number that no formula
-- reads.
function Particles:add(position, options)
  local record = record_of(self, "particles", "add")
  local x, y, z = vector(position, "position of a particle")
  local n = record.count + 1
  if options ~= nil then
    local numbers = type(options) == "table" and carry(record, options, of_particle,
      function(column, value) column.values[n] = value end)
    check_keys(options, with_numbers(of_particle, numbers), "the options of a particle")
    if options.mass ~= nil then
      record.masses[n] = number_from(options.mass, 0, true, "mass of a particle", " kg")
    end
    if options.velocity ~= nil then
      record.vx[n], record.vy[n], record.vz[n] =
        vector(options.velocity, "velocity of a particle")
    end
  end
  record.x[n], record.y[n], record.z[n] = x, y, z
  record.count = n
  return record.first + n - 1
end

-- particles:pin(id, ...)
-- Holds particles where they are, at velocity 0. At least one id; an id may come before its
-- particle is added. Errors: an id that is no whole number >= 0, or that no particle has at last.
function Particles:pin(...)
  local record = record_of(self, "particles", "pin")
  if select("#", ...) == 0 then bad("call of pin", "at least one particle id", nil) end
  local place = here()
  for i = 1, select("#", ...) do
    local pins = record.pins
    pins[#pins + 1] = integer_from((select(i, ...)), 0, MOST, "particle id of pin")
    pins[#pins + 1] = place
  end
end

-- particles:prescribe(id, path)
-- Prescribes the motion of a particle, whatever forces act on it.
--   path   a motion as of colliders (sim.motion.swing { ... }), from where the particle is, or a
--          function(t) that returns its place {x, y, z}, m, and may return its velocity second;
--          at t = 0 it is where the particle is
-- Errors: an id that is no whole number >= 0, or that no particle has at last; one that is
-- prescribed twice; a path that begins elsewhere.
function Particles:prescribe(id, path)
  local record = record_of(self, "particles", "prescribe")
  local prescribed, place = record.prescribed, here()
  id = integer_from(id, 0, MOST, "particle id of prescribe")
  if type(path) ~= "function" and not (records[path] and records[path].kind == "motion") then
    bad("path of prescribe", "a motion or a function(t)", path)
  end
  local n = #prescribed
  prescribed[n + 1], prescribed[n + 2], prescribed[n + 3] = id, path, place
end

function Particles:lead(id, path)
  renamed("particles:lead", "particles:prescribe")
  Particles.prescribe(self, id, path)
end

local function id_in_grid(record, i, j, k)
  i = integer_from(i, 0, record.n1 - 1, "row of id")
  j = integer_from(j, 0, record.n2 - 1, "column of id")
  if record.directions == 2 then
    if k ~= nil then bad("call of id", "two coordinates, id(i, j)", k) end
    return i * record.n2 + j
  end
  return (i * record.n2 + j) * record.n3 + integer_from(k, 0, record.n3 - 1, "layer of id")
end

-- id = grid:id(i, j), or grid:id(i, j, k) in a grid of three directions
-- The particle at that place, each coordinate from 0. Only of a sim.grid, or of what :add_grid
-- returned. Errors: a coordinate that the grid does not have.
function Particles:id(i, j, k)
  local record = record_of(self, "particles", "id")
  if not record.n3 then
    fail((here()), "bad call of id", "sim.particles has no rows and columns",
      "use the id that add returned, or sim.grid")
  end
  return id_in_grid(record, i, j, k)
end

local particles_class = class("particles", Particles)
particles_class.__len = function(self) return records[self].first + records[self].count end

local function new_particles(record)
  record.kind, record.count = "particles", 0
  record.x, record.y, record.z = {}, {}, {}
  record.masses, record.vx, record.vy, record.vz = {}, {}, {}, {}
  record.pins, record.prescribed, record.numbers, record.grids = {}, {}, {}, {}
  local handle = setmetatable({}, particles_class)
  records[handle] = record
  return handle
end

-- The same with the numbers of `options` that each particle carries which does not say its own.
local function carrying_particles(options, known, what, make)
  local numbers = { numbers = {} }
  local names = type(options) == "table" and carry(numbers, options, known,
    function(column, value) column.default = value end)
  check_keys(options, with_numbers(known, names), what)
  local handle = new_particles(make())
  records[handle].numbers = numbers.numbers
  return handle
end

-- particles = sim.particles { mass =, NAME = }
-- An empty list of particles; see :add and :pin. #particles is their number.
--   mass   kg, > 0; default 1; of the particles that are added without one
--   NAME   any other number: what each carries that is added without it, see :add
local function make_particles(options)
  options = options == nil and {} or options
  return carrying_particles(options, { mass = true }, "sim.particles", function()
    local mass = options.mass == nil and 1 or options.mass
    return {
      place = here(), first = 0, weighed = options.mass ~= nil,
      mass = number_from(mass, 0, true, "mass of sim.particles", " kg"),
    }
  end)
end

local function grid_record(options)
  local place = here()
  local directions = options[3] == nil and 2 or 3
  local n1 = integer_from(options[1], 1, MOST, "number of rows of sim.grid")
  local n2 = integer_from(options[2], 1, MOST, "number of columns of sim.grid")
  local n3 = 1
  if directions == 3 then n3 = integer_from(options[3], 1, MOST, "number of layers of sim.grid") end
  if n1 * n2 > MOST or n1 * n2 * n3 > MOST then
    fail(place, "too many particles in sim.grid",
      n1 .. " x " .. n2 .. (directions == 2 and "" or " x " .. n3) .. " is more than 2^31 - 1")
  end
  if directions == 2 and options.dw ~= nil then
    fail(place, "unknown key 'dw' in sim.grid", "the grid has two directions",
      "give three numbers of particles: sim.grid { n1, n2, n3, ... }")
  end
  local mass = options.mass == nil and 1 or options.mass
  local origin = options.origin == nil and { 0, 0, 0 } or options.origin
  return {
    place = place, first = n1 * n2 * n3, n1 = n1, n2 = n2, n3 = n3, directions = directions,
    origin = { vector(origin, "origin of sim.grid") },
    du = { vector(options.du, "du of sim.grid") },
    dv = { vector(options.dv, "dv of sim.grid") },
    dw = directions == 2 and { 0, 0, 0 } or { vector(options.dw, "dw of sim.grid") },
    mass = number_from(mass, 0, true, "mass of sim.grid", " kg"), weighed = options.mass ~= nil,
  }
end

local of_grid = { true, true, true, origin = true, du = true, dv = true, dw = true, mass = true }

-- grid = sim.grid { rows, cols, origin =, du =, dv =, mass =, NAME = }
-- grid = sim.grid { n1, n2, n3, origin =, du =, dv =, dw =, mass =, NAME = }
-- rows x cols particles; particle (i, j) is at origin + i*du + j*dv and has the id i*cols + j,
-- which grid:id(i, j) returns. With three numbers, particle (i, j, k) is at
-- origin + i*du + j*dv + k*dw and has the id (i*n2 + j)*n3 + k. :pin and :add work as for
-- sim.particles.
--   rows, cols   whole numbers >= 1, as n1, n2, n3; at most 2^31 - 1 particles
--   origin       m; default {0, 0, 0}
--   du, dv, dw   m, from one row, one column, one layer to the next
--   mass         kg, > 0, of each particle; default 1
--   NAME         any other number: what each particle carries, see :add
local function make_grid(options)
  return carrying_particles(options, of_grid, "sim.grid", function() return grid_record(options) end)
end

local AddedGrid = {}

function AddedGrid:id(i, j, k)
  local record = record_of(self, "added_grid", "id")
  return record.start + id_in_grid(record, i, j, k)
end

function AddedGrid:pin(...)
  Particles.pin(record_of(self, "added_grid", "pin").on, ...)
end

function AddedGrid:prescribe(id, path)
  Particles.prescribe(record_of(self, "added_grid", "prescribe").on, id, path)
end

local function is_grid(record)
  return record and (record.kind == "added_grid" or record.kind == "particles" and record.n3)
end

local added_grid_class = class("grid", AddedGrid)
added_grid_class.__len = function(self) return records[self].first end

-- grid = particles:add_grid { rows, cols, origin =, du =, dv =, mass =, NAME = }
-- grid = particles:add_grid { n1, n2, n3, origin =, du =, dv =, dw =, mass =, NAME = }
-- Adds a grid of particles, so that a scene may have several: two cloths, or a cloth and a block.
-- The options are those of sim.grid; without mass, particles have that of the list. Forces,
-- constraints, surfaces and cells take what it returns as their grid, forces also as their
-- particles. Its :id(i, j) or :id(i, j, k) is an id of the list, which its :pin and :prescribe take,
-- too. #grid is the number of its particles.
-- Errors: as of sim.grid.
function Particles:add_grid(options)
  local list = record_of(self, "particles", "add_grid")
  local columns = {}
  local names = type(options) == "table" and carry(list, options, of_grid,
    function(column, value) columns[#columns + 1] = { column.values, value } end)
  check_keys(options, with_numbers(of_grid, names), "add_grid")
  local grid = grid_record(options)
  local o, du, dv, dw = grid.origin, grid.du, grid.dv, grid.dw
  local x, y, z, n = list.x, list.y, list.z, list.count
  if list.first + n + grid.first > MOST then
    fail(grid.place, "too many particles in add_grid", "they are more than 2^31 - 1 in all")
  end
  grid.kind, grid.on, grid.start = "added_grid", self, list.first + n
  for i = 0, grid.n1 - 1 do
    for j = 0, grid.n2 - 1 do
      for k = 0, grid.n3 - 1 do
        n = n + 1
        x[n] = o[1] + i * du[1] + j * dv[1] + k * dw[1]
        y[n] = o[2] + i * du[2] + j * dv[2] + k * dw[2]
        z[n] = o[3] + i * du[3] + j * dv[3] + k * dw[3]
      end
    end
  end
  for i = list.count + 1, n do
    if options.mass ~= nil then list.masses[i] = grid.mass end
    for c = 1, #columns do columns[c][1][i] = columns[c][2] end
  end
  list.count = n
  list.grids[#list.grids + 1] = grid
  local handle = setmetatable({}, added_grid_class)
  records[handle] = grid
  return handle
end

-- Rigid bodies -----------------------------------------------------------------------------------

local shape_class = class("shape", {})

local function new_shape(form, options, known, fields)
  check_keys(options, known, "sim." .. form)
  local record = fields(options)
  record.kind, record.form, record.place = "shape", form, here()
  local handle = setmetatable({}, shape_class)
  records[handle] = record
  return handle
end

-- shape = sim.box { half = }
-- A box about its origin, for sim.rigid.
--   half   {x, y, z}, m, > 0: half of its edges
local function make_box(options)
  return new_shape("box", options, { half = true }, function(o)
    local x, y, z = vector(o.half, "half of sim.box")
    for _, edge in ipairs { x, y, z } do number_from(edge, 0, true, "half of sim.box", " m") end
    return { half = { x, y, z } }
  end)
end

-- shape = sim.sphere { radius = }
-- A ball about its origin, for sim.rigid.
--   radius   m, > 0
local function make_sphere(options)
  return new_shape("sphere", options, { radius = true }, function(o)
    return { radius = number_from(o.radius, 0, true, "radius of sim.sphere", " m") }
  end)
end

-- shape = sim.capsule { radius =, length = }
-- A cylinder along y about its origin, closed by half balls, for sim.rigid.
--   radius   m, > 0
--   length   m, > 0, of the cylinder
local function make_capsule(options)
  return new_shape("capsule", options, { radius = true, length = true }, function(o)
    return { radius = number_from(o.radius, 0, true, "radius of sim.capsule", " m"),
      length = number_from(o.length, 0, true, "length of sim.capsule", " m") }
  end)
end

-- shape = sim.mesh { points =, triangles = }
-- What a closed surface holds, for sim.rigid. Its mass is that of its inside.
--   points      list of {x, y, z}, m
--   triangles   list of {a, b, c}, numbers of points from 0, counter-clockwise as seen from outside
-- Errors, when the scene is finished: an edge without two triangles, triangles inside out.
local function make_mesh(options)
  return new_shape("mesh", options, { points = true, triangles = true }, function(o)
    local points, triangles = {}, {}
    for name, list in next, { points = o.points or 0, triangles = o.triangles or 0 } do
      if type(list) ~= "table" or #list == 0 then bad(name .. " of sim.mesh", "a list", list) end
    end
    for i = 1, #o.points do
      points[3 * i - 2], points[3 * i - 1], points[3 * i] =
        vector(o.points[i], "point " .. i .. " of sim.mesh")
    end
    for i = 1, #o.triangles do
      local triangle = o.triangles[i]
      if type(triangle) ~= "table" or #triangle ~= 3 then
        bad("triangle " .. i .. " of sim.mesh", "three numbers {a, b, c}", triangle)
      end
      for corner = 1, 3 do
        triangles[3 * i - 3 + corner] =
          integer_from(triangle[corner], 0, #o.points - 1, "triangle " .. i .. " of sim.mesh")
      end
    end
    return { points = points, triangles = triangles }
  end)
end

-- shape = sim.compound { { SHAPE, at = {0, 0, 0}, rotation = {0, 0, 0} }, ... }
-- Shapes that keep their places to each other, for sim.rigid. Each is convex or round; together they
-- need not be. Where they overlap the mass of each counts.
--   SHAPE      sim.box, sim.sphere, sim.capsule or sim.mesh; 1 to 100 of them
--   at         m, where the origin of the shape is; default {0, 0, 0}
--   rotation   rad, about this axis by its length; default {0, 0, 0}
local function make_compound(options)
  if type(options) ~= "table" or #options == 0 or #options > 100 then
    bad("list of sim.compound", "1 to 100 parts", options,
      "write sim.compound { { sim.box { half = {1, 1, 1} }, at = {0, 1, 0} } }")
  end
  local known = {}
  for i = 1, #options do known[i] = true end
  return new_shape("compound", options, known, function(o)
    local parts = {}
    for i, part in ipairs(o) do
      local name = "part " .. i .. " of sim.compound"
      if type(part) ~= "table" or records[part] then
        bad(name, "{ SHAPE, at = ... }", part, "write { sim.sphere { radius = 1 }, at = {0, 1, 0} }")
      end
      check_keys(part, { true, at = true, rotation = true }, name)
      local shape = records[part[1]]
      if not shape or shape.kind ~= "shape" or shape.form == "compound" then
        bad("shape of " .. name, "a sim.box, sim.sphere, sim.capsule or sim.mesh", part[1])
      end
      local record = { shape = part[1] }
      for _, key in ipairs { "at", "rotation" } do
        record[key] = { vector(part[key] == nil and { 0, 0, 0 } or part[key], key .. " of " .. name) }
      end
      parts[i] = record
    end
    return { parts = parts }
  end)
end

local Rigid = {}
local point_class = class("point", {})

-- point = body:at {x, y, z}
-- A point of the body, in the frame of its shape, m: for force:tie, constraint:tie, their `ties`, and
-- the `particles` of a constraint.
function Rigid:at(place)
  record_of(self, "rigid", "at")
  local x, y, z = vector(place, "point of a body")
  local handle = setmetatable({}, point_class)
  records[handle] = { kind = "point", body = self, at = { x, y, z } }
  return handle
end

local rigid_class = class("rigid", Rigid)

-- body = sim.rigid { shape =, mass =, position =, rotation =, velocity =, angular_velocity =,
--   friction =, restitution =, law =, touches = }
-- A rigid body, for the scene's key `bodies`. It is four particles that keep their places to each
-- other, with its mass and moments: forces on particles act on it, ties pull at body:at{...}.
--   shape         sim.box, sim.sphere, sim.capsule, sim.mesh or sim.compound
--   mass          kg, > 0; or
--   density       kg/m^3, > 0
--   position      m, where the origin of the shape is; default {0, 0, 0}
--   rotation      rad, about this axis by its length; default {0, 0, 0}
--   velocity      m/s, of the center of mass; default {0, 0, 0}
--   angular_velocity   rad/s, in space; default {0, 0, 0}
--   friction      Coulomb's, >= 0; default 0; of two that touch the geometric mean
--   restitution   0 to 1; default 0; of two that touch the larger
--   law           sim.law.NAME { ... }, in place of friction and restitution
--   touches       false: it goes through particles, colliders and bodies; default true
local function make_rigid(options)
  check_keys(options, { shape = true, mass = true, density = true, position = true, rotation = true,
    velocity = true, angular_velocity = true, friction = true, restitution = true, law = true,
    touches = true, turn = true, spin = true }, "sim.rigid")
  local place = here()
  local given = {}
  for old, new in next, { turn = "rotation", spin = "angular_velocity" } do
    if options[old] ~= nil then
      if options[new] ~= nil then
        fail(place, "bad argument of sim.rigid", "it has both " .. new .. " and its old name " .. old)
      end
      renamed(old .. " of sim.rigid", new)
      given[new] = options[old]
    end
  end
  local shape = records[options.shape]
  if not shape or shape.kind ~= "shape" then
    bad("shape of sim.rigid", "a sim.box, sim.sphere, sim.capsule, sim.mesh or sim.compound", options.shape,
      "write shape = sim.box { half = {1, 1, 1} }")
  end
  if (options.mass == nil) == (options.density == nil) then
    fail(place, "bad argument of sim.rigid", "expected either mass or density")
  end
  local record = { kind = "rigid", place = place, shape = options.shape,
    mass = options.mass ~= nil and number_from(options.mass, 0, true, "mass of a body", " kg") or 0,
    density = options.density ~= nil
      and number_from(options.density, 0, true, "density of a body", " kg/m^3") or 0,
    friction = number_from(options.friction == nil and 0 or options.friction, 0, false,
      "friction of a body", ""),
    restitution = number_from(options.restitution == nil and 0 or options.restitution, 0, false,
      "restitution of a body", ""),
  }
  if record.restitution > 1 then
    bad("restitution of a body", "a number from 0 to 1", options.restitution)
  end
  if options.law ~= nil then
    if not (records[options.law] and records[options.law].kind == "law") then
      bad("law of a body", "a sim.law.NAME { ... }", options.law)
    end
    if options.friction ~= nil or options.restitution ~= nil then
      fail(place, "bad law of a body", "friction or restitution is given beside it, and it has its own",
        "give either the law or these numbers, which are sim.law.coulomb")
    end
    record.law = options.law
  end
  record.touches = options.touches ~= false
  if options.touches ~= nil and type(options.touches) ~= "boolean" then
    bad("touches of a body", "true or false", options.touches)
  end
  for _, name in ipairs { "position", "rotation", "velocity", "angular_velocity" } do
    local value = options[name] == nil and given[name] or options[name]
    record[name] = { vector(value == nil and { 0, 0, 0 } or value, name .. " of a body") }
  end
  local handle = setmetatable({}, rigid_class)
  records[handle] = record
  return handle
end

-- Forces and fields ------------------------------------------------------------------------------

local Force = {}

-- One element of a force. The kernel checks it against what the plugin takes.
local function add_element(record, place, a, b, c, d, options)
  local arity = c == nil and 2 or d == nil and 3 or 4
  local n = record.count + 1
  if n == 1 then
    record.arity = arity
  elseif record.arity ~= arity then
    fail(place, "bad tie", "it joins " .. arity .. " particles, those before it " .. record.arity)
  end
  if a == b or a == c or b == c and c ~= nil or d ~= nil and (a == d or b == d or c == d) then
    fail(place, "bad tie", "particle " .. tostring((a == b or a == c or a == d) and a
      or (b == c or b == d) and b or c) .. " is tied to itself")
  end
  local ids, last = record.ids, arity * (n - 1)
  ids[last + 1], ids[last + 2] = a, b
  if c ~= nil then ids[last + 3] = c end
  if d ~= nil then ids[last + 4] = d end
  for slot = last + 1, last + arity do
    if type(ids[slot]) == "table" then  -- a point of a body
      record.points = record.points or {}
      record.points[slot], ids[slot] = ids[slot], -1
    end
  end
  record.places[n] = place
  record.count = n
  if options == nil then return end
  for key, value in next, options do
    if type(key) ~= "string" then bad("key in the options of a tie", "a name", key) end
    if type(value) ~= "number" or value - value ~= 0 then
      bad(key .. " of a tie", "a finite number", value)
    end
    local column = record.values[key]
    if not column then
      column = {}
      record.values[key] = column
    end
    column[n] = value
  end
end

local function id_of_tie(id)
  if math_type(id) == "integer" and id >= 0 and id <= MOST then return id end
  local record = records[id]
  if record and record.kind == "point" then return id end
  return integer_from(id, 0, MOST, "particle id of tie")
end

local tied = {}  -- forces that join something, in order: each belongs into a scene

-- force:tie(a, b, { NAME = number, ... })
-- Joins two particles, or three or four: as many as `sim describe NAME` shows for the force.
--   a, b   particle ids, different; all must exist when the scene is finished; or points of rigid
--          bodies, body:at{x, y, z}
--   NAME   a parameter of the force that a tie may give for itself: of a spring stiffness, N/m,
--          rest, m, and damping, N s/m; default: what the force says
-- The key ties = { {a, b, NAME = number}, ... } of the force does the same for a list.
-- Returns the force.
function Force:tie(a, b, c, d, options)
  local record = records[self]
  if not record or record.kind ~= "constraint" then record = record_of(self, "force", "tie") end
  a, b = id_of_tie(a), id_of_tie(b)
  if c == nil or type(c) == "table" and not records[c] then
    c, d, options = nil, nil, c
  elseif d == nil or type(d) == "table" and not records[d] then
    c, d, options = id_of_tie(c), nil, d
  else
    c, d = id_of_tie(c), id_of_tie(d)
    if type(options or {}) ~= "table" then bad("argument of tie", "a table", options) end
  end
  if record.count == 0 then tied[#tied + 1] = self end
  add_element(record, (here()), a, b, c, d, options)
  return self
end

-- The key `ties` of a force.
local function add_ties(record, ties)
  if type(ties) ~= "table" then bad("ties", "a list { {a, b}, ... }", ties) end
  for i = 1, #ties do
    local tie = ties[i]
    if type(tie) ~= "table" then bad("tie " .. i, "a list of ids {a, b}", tie) end
    local options
    for key, value in next, tie do
      if key ~= 1 and key ~= 2 and key ~= 3 and key ~= 4 then
        options = options or {}
        options[key] = value
      end
    end
    add_element(record, record.place, id_of_tie(tie[1]), id_of_tie(tie[2]),
      tie[3] and id_of_tie(tie[3]), tie[4] and id_of_tie(tie[4]), options)
  end
end

-- Surfaces ---------------------------------------------------------------------------------------

local surface_class = class("surface", {})

-- skin = sim.surface { grid = }  or  sim.surface { particles =, triangles = }
-- Triangles between particles: for forces that act on a surface, and for pictures. A force names it
-- as `surface = skin`, a scene may list it in `surfaces`.
--   grid        a sim.grid, or what :add_grid returned: two triangles a cell, with the outside where
--               du x dv points; of a block in three directions its boundary, seen from outside
--   particles   a sim.particles or sim.grid
--   triangles   list of {a, b, c}, different ids, counter-clockwise as seen from outside
-- Errors, when the scene is finished: a particle that does not exist, a triangle without area, an
-- edge with more than two triangles, neighbours that have different sides outside.
local function make_surface(options)
  check_keys(options, { grid = true, particles = true, triangles = true }, "sim.surface")
  local place = here()
  local grid = options.grid ~= nil
  if grid == (options.triangles ~= nil) or grid == (options.particles ~= nil) then
    fail(place, "bad argument of sim.surface",
      "expected either grid, or particles and triangles")
  end
  local on = options.grid
  if not grid then on = options.particles end
  local record = records[on]
  if not (grid and is_grid(record) or not grid and record and record.kind == "particles") then
    bad((grid and "grid" or "particles") .. " of sim.surface",
      grid and "a sim.grid" or "a sim.particles or sim.grid", on)
  end
  local ids = {}
  if not grid then
    local triangles = options.triangles
    if type(triangles) ~= "table" then bad("triangles", "a list { {a, b, c}, ... }", triangles) end
    for i = 1, #triangles do
      local triangle = triangles[i]
      if type(triangle) ~= "table" or #triangle ~= 3 then
        bad("triangle " .. i, "three ids {a, b, c}", triangle)
      end
      for corner = 1, 3 do
        ids[3 * i - 3 + corner] =
          integer_from(triangle[corner], 0, MOST, "particle id of triangle " .. i)
      end
    end
  end
  local handle = setmetatable({}, surface_class)
  records[handle] = { kind = "surface", place = place, on = on, grid = grid, ids = ids }
  return handle
end

-- Contact of surfaces ----------------------------------------------------------------------------

-- contact = sim.contact { surfaces =, thickness =, friction =, self =, strain_limit = }
-- Surfaces that do not pass through each other or themselves, for the scene's key `contact`: what is
-- apart at the start never crosses, with any step size and any method of fixed steps. It acts after
-- each step, on places and velocities; the energy that it takes is in the work of --energy.
--   surfaces    list of sim.surface{...}
--   thickness   m, > 0: the distance that layers keep; at most half of the shortest edge
--   friction    of layers on each other, >= 0; default 0
--   self        whether a surface touches itself, or only the others; default true
--   strain_limit   > 0: edges of the surfaces are held to (1 + strain_limit) times their length at the
--               start, as far as some sweeps over them reach; default: no limit
-- Constraints stay obeyed where contact acts. This is sim.contact.surfaces; another plugin of the kind
-- is sim.contact.NAME { surfaces =, ... }, with the parameters that `sim describe NAME` shows. Without
-- surfaces it is the contact of the scene's bodies: sim.contact.bodies { tolerance =, ... }.
-- Errors: surfaces that cross or touch at the start (it names two triangles), constraints with
-- feedback, an adaptive method.
local function take_surfaces(record)
  local list, surfaces = record.given.surfaces, {}
  if list == nil and record.plugin == "bodies" then
    record.surfaces = surfaces
    return
  end
  if type(list) ~= "table" or records[list] or #list == 0 then
    bad("surfaces of sim.contact", "a list { sim.surface { ... }, ... }", list)
  end
  for i = 1, #list do
    local of = records[list[i]]
    if not of or of.kind ~= "surface" then
      bad("entry " .. i .. " of surfaces of sim.contact", "a sim.surface", list[i])
    end
    surfaces[i] = list[i]
  end
  record.given.surfaces, record.surfaces = nil, surfaces
end

-- Cells ------------------------------------------------------------------------------------------

local cells_class = class("cells", {})

-- body = sim.cells { grid =, order = }  or  sim.cells { particles =, tetrahedra = }
-- Tetrahedra that fill a body, for a force that acts in them: sim.force.fem { cells = body }.
--   grid         a sim.grid of three directions, or what :add_grid returned: six tetrahedra a cell
--   order        1 (default): tetrahedra of 4 particles; 2: of 10, each cell over two steps of the
--                grid, whose numbers of particles are odd then
--   particles    a sim.particles or sim.grid
--   tetrahedra   list of {a, b, c, d}, or of ten ids: the corners and then a particle on each edge
--                ab, bc, ac, ad, bd, cd
-- Errors, when the scene is finished: a particle that does not exist, a tetrahedron without volume.
local function make_cells(options)
  check_keys(options, { grid = true, order = true, particles = true, tetrahedra = true },
    "sim.cells")
  local place = here()
  local grid = options.grid ~= nil
  if grid == (options.tetrahedra ~= nil) or grid == (options.particles ~= nil) then
    fail(place, "bad argument of sim.cells", "expected either grid, or particles and tetrahedra")
  end
  local on = options.grid
  if not grid then on = options.particles end
  local record = records[on]
  if not (grid and is_grid(record) and record.directions == 3
    or not grid and record and record.kind == "particles") then
    bad((grid and "grid" or "particles") .. " of sim.cells",
      grid and "a sim.grid of three directions" or "a sim.particles or sim.grid", on)
  end
  local order = options.order == nil and 1 or integer_from(options.order, 1, 2, "order of sim.cells")
  local ids, arity = {}, 4
  if grid then
    for _, n in ipairs { record.n1, record.n2, record.n3 } do
      if n <= order or (n - 1) % order ~= 0 then
        fail(place, "bad grid of sim.cells", "a direction of it has " .. n .. " particles",
          order == 1 and "give at least 2" or "give an odd number of at least 3")
      end
    end
  else
    local list = options.tetrahedra
    if options.order ~= nil then
      fail(place, "bad order of sim.cells", "the number of ids says it", "leave order out")
    end
    if type(list) ~= "table" or #list == 0 then
      bad("tetrahedra", "a list { {a, b, c, d}, ... }", list)
    end
    for i = 1, #list do
      local tetrahedron = list[i]
      if type(tetrahedron) ~= "table" or #tetrahedron ~= 4 and #tetrahedron ~= 10 then
        bad("tetrahedron " .. i, "four ids {a, b, c, d}, or ten", tetrahedron)
      end
      if i == 1 then
        arity = #tetrahedron
      elseif arity ~= #tetrahedron then
        fail(place, "bad tetrahedron " .. i, "it has " .. #tetrahedron .. " ids, the first " .. arity)
      end
      for corner = 1, arity do
        ids[arity * (i - 1) + corner] =
          integer_from(tetrahedron[corner], 0, MOST, "particle id of tetrahedron " .. i)
      end
    end
  end
  local handle = setmetatable({}, cells_class)
  records[handle] = { kind = "cells", place = place, on = on, grid = grid, order = order, ids = ids,
    arity = arity }
  return handle
end

local part_class = {}
for _, kind in ipairs(host.kinds) do
  part_class[kind] = class(kind, (kind == "force" or kind == "constraint") and Force or {})
end

-- Lists inside the options are taken as they are now: changing them later changes nothing.
local function copy(value, depth)
  if type(value) ~= "table" or records[value] or depth == 0 then return value end
  local result = {}
  for key, entry in next, value do result[key] = copy(entry, depth - 1) end
  return result
end

-- Plugins that were renamed: old name -> new name. The old names are aliases of the plugins.
local OLD_PLUGINS = { ["force.solid"] = "force.fem" }

-- part = sim.KIND.NAME { ... }
-- KIND is a kind of plugin: force, field, integrator, collider, motion, law, constraint, contact. NAME is
-- any plugin that `sim list` shows, with the parameters that `sim describe NAME` shows. A parameter may be marked there as
-- positional; it can then be written without its name, first in the table.
-- Forces and constraints that join particles also take ties = { {a, b}, ... }, see force:tie; and
-- those that act between pairs a grid of pairs:
--   grid      the sim.grid that is the scene's particles, what their :add_grid returned, or a list
--             of such grids: one force for many grids is faster than many forces
--   offsets   list of {di, dj}, whole numbers, not all 0: each ties (i, j) to (i + di, j + dj)
--             wherever both exist, with the rest length |di*du + dj*dv| unless `rest` is given;
--             {di, dj, dk} in a grid of three directions
-- Those that act in the cells of a body:
--   cells     a sim.cells
-- Forces that act on each particle by itself, such as gravity, can be kept to some:
--   particles   list of ids, or what :add_grid returned; default: all. Constraints on single
--               particles need it.
-- A force or collider can be off at the start, for good unless the scene names a switch for it:
--   on          true or false; default true
-- The method imex, implicit in stiff forces alone, finds these by itself, unless a force says:
--   stiff       true or false: all of it is implicit, or explicit
local function constructors(kind)
  return setmetatable({}, {
    __metatable = "sim." .. kind,
    __newindex = function(_, key)
      fail((here()), "cannot set '" .. tostring(key) .. "' of sim." .. kind,
        "it holds the plugins")
    end,
    __index = function(_, plugin)
      local written = here()
      if type(plugin) ~= "string" then bad("name after sim." .. kind, "text", plugin) end
      return function(options)
        -- `return sim.force.NAME{}` hides the line of the call; where it was written is as good.
        local place, tail = here()
        if tail then place = written end
        options = options == nil and {} or options
        if type(options) ~= "table" or records[options] then
          fail(place, "bad argument of sim." .. kind .. "." .. plugin,
            "expected a table of parameters, got " .. show(options))
        end
        local new = OLD_PLUGINS[kind .. "." .. plugin]
        if new then renamed("sim." .. kind .. "." .. plugin, "sim." .. new) end
        local handle = setmetatable({}, part_class[kind])
        local record = {
          kind = kind, plugin = plugin, place = place, given = copy(options, 3),
          count = 0, arity = 2, ids = {}, places = {}, values = {},
        }
        records[handle] = record
        if kind == "contact" then take_surfaces(record) end
        if (kind == "force" or kind == "constraint") and options.ties ~= nil then
          record.given.ties = nil
          add_ties(record, options.ties)
          if record.count > 0 then tied[#tied + 1] = handle end
        end
        return handle
      end
    end,
    __call = kind == "contact" and function(contacts, options) return contacts.surfaces(options) end
      or nil,
  })
end

-- sim.plugin(file)
-- Opens a plugin library that lies beside the scene's file, or in a folder below, before what it
-- brings is used: sim.plugin "wind.so". Once is enough. It is machine code: know where it is from.
-- Errors: a file that is not there, that is no plugin of this kernel, or with a name that is taken.
local function open_plugin(file)
  host.plugin((here()), file)
end

-- Scenes -----------------------------------------------------------------------------------------

-- value = sim.arg(name, default, doc)
-- Declares a parameter of the scene, set on the command line by `--set name=value`.
--   name      letters, digits and _
--   default   a number, text, true or false; a setting must be of the same type
--   doc       what it is, with its unit between commas ("of the spring, N/m"); shown by `sim describe`.
--             A parameter in another unit that it is given to as it is, `rest = k`, refuses it
-- The same name may be declared again with the same default. In a sim.world a setting reaches every
-- scene that declares its name; `--set cloth.n=16` reaches the one in the file cloth.lua only.
local function arg(name, default, doc)
  return host.arg((here()), name, default, doc)
end

-- scene = sim.scene { ... }
--   name         text; default: the name of the file
--   integrator   name or alias of an integrator, as `sim list integrators` shows, or a
--                sim.integrator.NAME{...} with its parameters
--   dt           step size in s, > 0; for an adaptive integrator the time between states
--   duration     s, >= 0: how long a run lasts unless it is told otherwise
--   sleep        optional: particles that ties, cells or surfaces join take no steps once their kinetic
--                energy has stayed below this, in J, for half a second, until something comes near or
--                changes them; or { energy = J, after = s }. Not with rigid bodies, fluids or pairs
--   exact        optional function(t) that returns the exact solution at time t (s), in the form of
--                `state`; for particles the list of their positions
--   observe      optional { NAME = function(s) return NUMBER end, ... }: quantities of your own, for
--                --observe, --verify and `sim tradeoff --of NAME`. s is the state:
--                  s:t()           s
--                  s:position(i)   {x, y, z} of a particle or point, m
--                  s:velocity(i)   {vx, vy, vz} of a particle, m/s
--                  s:body(i)       of a rigid body, the first is 0: its position and velocity (of the
--                                  center of mass), rotation {w, x, y, z} and
--                                  angular_velocity, by name
--                  s:energy()      total, kinetic, potential, J; of particles
--                  s:component(i)  of a flat state; the first is 0
-- Second order (particles with mass and velocity):
--   particles    a sim.particles or sim.grid; may be left out where there are bodies
--   bodies       optional list of sim.rigid{...}
--   forces       list of sim.force.NAME{...}, may be empty
--   surfaces     optional list of sim.surface{...}, besides those that forces name
--   colliders    optional list of sim.collider.NAME{...}: what particles may not go through
--   accuracy     of what touches colliders, "settle" (found inside a step, the default), "project" (put
--                back at its end: of first order, for comparison) or "event" (steps end there)
--   constraints  optional list of sim.constraint.NAME{...}: what particles must obey
--   contact      optional sim.contact{...}: surfaces that do not pass through each other; or
--                sim.contact.bodies{...}: how bodies touch, where not to rounding
--   switches     optional { NAME = PART, ... }: forces and colliders that can be turned on and off
--                while the scene runs, by .toggle NAME, or left off by --off NAME
-- First order (no masses, no velocities):
--   state        { x = list of vectors } for points of space, or a flat list of numbers
--   field        a sim.field.NAME{...}: the right-hand side of x' = f(t, x)
-- Returns a table that may still be changed, key by key, before the file returns it.

-- world = sim.world { NAME = scene, ... }
-- Several scenes side by side, each with its own state and integrator, in the order of their names.
-- Names are made of letters, digits, _ and -. A scene comes from sim.scene or from
-- `require "scenes.FILE"`, which returns an independent scene every time.
--
-- Both come from here, made anew wherever a scene writes their name: that keeps its line.
local function top_constructor(kind, written)
  return function(entries)
    local place, tail = here()
    if tail then place = written end  -- as above: `return sim.scene{}` hides the line of the call
    if type(entries) ~= "table" then
      fail(place, "bad argument of sim." .. kind, "expected a table, got " .. show(entries))
    end
    local result = {}
    for key, entry in next, entries do result[key] = entry end
    for _, parts in next, { result.forces, result.constraints } do
      if type(parts) == "table" then
        for _, part in next, parts do
          if records[part] then records[part].used = true end
        end
      end
    end
    records[result] = { kind = kind, place = place }
    return result
  end
end

local entries = {
  arg = arg, plugin = open_plugin, particles = make_particles, grid = make_grid,
  surface = make_surface, cells = make_cells,
  rigid = make_rigid, box = make_box, sphere = make_sphere, capsule = make_capsule,
  compound = make_compound,
  mesh = make_mesh,
  scene = "made where it is written", world = "made where it is written",
}
for _, kind in ipairs(host.kinds) do entries[kind] = constructors(kind) end

local sim = setmetatable({}, {
  __index = function(_, key)
    if key == "scene" or key == "world" then return top_constructor(key, (here())) end
    local entry = entries[key]
    if entry == nil then
      fail((here()), "unknown name 'sim." .. tostring(key) .. "'",
        "the scene language has no such name", suggest(key, entries))
    end
    return entry
  end,
  __newindex = function(_, key)
    fail((here()), "cannot set 'sim." .. tostring(key) .. "'", "the scene language is fixed",
      "use a local variable")
  end,
  __metatable = "sim",
})

return sim, records, tied
