#include "cli/verbs/luacats_language.h"

namespace sim::cli {

const char* const kLanguageClasses =
    R"(---@alias sim.Vector number[] {x, y, z}, or as many numbers as the space has
---@alias sim.End integer|sim.Point the id of a particle, or a point of a body

---@class sim.Particles
---@operator len: integer
local Particles = {}

---@class sim.Grid : sim.Particles
local Grid = {}

---@class sim.AddedGrid
---@operator len: integer
local AddedGrid = {}

---@class sim.Shape

---@class sim.Point

---@class sim.Rigid
local Rigid = {}

---@class sim.Surface

---@class sim.Cells

---@class sim.Tied
local Tied = {}

---@class sim.BodyState
---@field position sim.Vector m, of the center of mass
---@field velocity sim.Vector m/s, of the center of mass
---@field rotation number[] {w, x, y, z}
---@field angular_velocity sim.Vector rad/s

---@class sim.State
local State = {}

---@return number t s
function State:t() end

---@param i integer
---@return sim.Vector x m
function State:position(i) end

---@param i integer
---@return sim.Vector v m/s
function State:velocity(i) end

---@param i integer the first is 0
---@return sim.BodyState
function State:body(i) end

---@return { total: number, kinetic: number, potential: number } energy J
function State:energy() end

---@param i integer the first is 0
---@return number
function State:component(i) end

---@class sim.ParticleOptions
---@field mass? number kg, > 0
---@field velocity? sim.Vector m/s
---@field [string] number what it carries, for formulas

---@class sim.ParticlesOptions
---@field mass? number kg, > 0; default 1
---@field [string] number what each carries, for formulas

---@class sim.GridOptions
---@field [1] integer rows
---@field [2] integer columns
---@field [3]? integer layers
---@field origin? sim.Vector m
---@field du sim.Vector m, from one row to the next
---@field dv sim.Vector m, from one column to the next
---@field dw? sim.Vector m, from one layer to the next
---@field mass? number kg, of each; default 1
---@field [string] number what each carries, for formulas

---@class (exact) sim.BoxOptions
---@field half sim.Vector m, half of its edges

---@class (exact) sim.SphereOptions
---@field radius number m

---@class (exact) sim.CapsuleOptions
---@field radius number m
---@field length number m, of the cylinder

---@class (exact) sim.CompoundPart
---@field [1] sim.Shape
---@field at? sim.Vector m
---@field rotation? sim.Vector rad, about this axis by its length

---@class (exact) sim.MeshOptions
---@field points sim.Vector[] m
---@field triangles integer[][] numbers of points from 0

---@class (exact) sim.RigidOptions
---@field shape sim.Shape
---@field mass? number kg
---@field density? number kg/m^3
---@field position? sim.Vector m
---@field rotation? sim.Vector rad
---@field velocity? sim.Vector m/s
---@field angular_velocity? sim.Vector rad/s
---@field friction? number
---@field restitution? number 0 to 1
---@field law? sim.law
---@field touches? boolean

---@class (exact) sim.SurfaceOptions
---@field grid? sim.Grid|sim.AddedGrid
---@field particles? sim.Particles
---@field triangles? integer[][]

---@class (exact) sim.CellsOptions
---@field grid? sim.Grid|sim.AddedGrid
---@field order? 1|2
---@field particles? sim.Particles
---@field tetrahedra? integer[][]

---@class sim.Scene : sim.SceneOptions

---@class (exact) sim.SceneOptions
---@field name? string
---@field integrator string|sim.integrator
---@field dt number s
---@field duration? number s
---@field exact? fun(t: number): table
---@field observe? table<string, fun(s: sim.State): number>
---@field error? number|string
---@field look? table<string, any>
---@field particles? sim.Particles
---@field bodies? sim.Rigid[]
---@field forces? sim.force[]
---@field surfaces? sim.Surface[]
---@field colliders? sim.collider[]
---@field accuracy? "settle"|"project"|"event"
---@field constraints? sim.constraint[]
---@field contact? sim.contact
---@field switches? table<string, sim.force|sim.collider>
---@field state? number[]|{ x: sim.Vector[] }
---@field field? sim.field

---@class sim.World

)";

namespace {

constexpr LanguageFunction kFunctions[] = {
    {"Particles", "add", "position, options",
     "---@param position sim.Vector\n---@param options? sim.ParticleOptions\n"
     "---@return integer id\n"},
    {"Particles", "pin", "...", "---@param ... integer\n"},
    {"Particles", "prescribe", "id, path",
     "---@param id integer\n---@param path sim.motion|fun(t: number): sim.Vector, sim.Vector?\n"},
    {"Particles", "add_grid", "options",
     "---@param options sim.GridOptions\n---@return sim.AddedGrid grid\n"},
    {"Grid", "id", "i, j, k",
     "---@param i integer\n---@param j integer\n---@param k? integer\n---@return integer id\n"},
    {"AddedGrid", "id", "i, j, k",
     "---@param i integer\n---@param j integer\n---@param k? integer\n---@return integer id\n"},
    {"AddedGrid", "pin", "...", "---@param ... integer\n"},
    {"AddedGrid", "prescribe", "id, path",
     "---@param id integer\n---@param path sim.motion|fun(t: number): sim.Vector, sim.Vector?\n"},
    {"Rigid", "at", "place", "---@param place sim.Vector\n---@return sim.Point\n"},
    {"Tied", "tie", "a, b, ...",
     "---@param a sim.End\n---@param b sim.End\n---@param ... sim.End|table<string, number>\n"
     "---@return sim.Tied\n"},
    {"sim", "arg", "name, default, doc",
     "---@generic T : number|string|boolean\n---@param name string\n---@param default T\n"
     "---@param doc? string\n---@return T\n"},
    {"sim", "plugin", "file", "---@param file string\n"},
    {"sim", "particles", "options",
     "---@param options? sim.ParticlesOptions\n---@return sim.Particles\n"},
    {"sim", "grid", "options", "---@param options sim.GridOptions\n---@return sim.Grid\n"},
    {"sim", "box", "options", "---@param options sim.BoxOptions\n---@return sim.Shape\n"},
    {"sim", "sphere", "options", "---@param options sim.SphereOptions\n---@return sim.Shape\n"},
    {"sim", "capsule", "options", "---@param options sim.CapsuleOptions\n---@return sim.Shape\n"},
    {"sim", "compound", "parts", "---@param parts sim.CompoundPart[]\n---@return sim.Shape\n"},
    {"sim", "mesh", "options", "---@param options sim.MeshOptions\n---@return sim.Shape\n"},
    {"sim", "rigid", "options", "---@param options sim.RigidOptions\n---@return sim.Rigid\n"},
    {"sim", "surface", "options", "---@param options sim.SurfaceOptions\n---@return sim.Surface\n"},
    {"sim", "cells", "options", "---@param options sim.CellsOptions\n---@return sim.Cells\n"},
    {"sim", "scene", "entries", "---@param entries sim.SceneOptions\n---@return sim.Scene\n"},
    {"sim", "world", "scenes", "---@param scenes table<string, sim.Scene>\n---@return sim.World\n"},
};

}  // namespace

std::span<const LanguageFunction> language_functions() { return kFunctions; }

}  // namespace sim::cli
