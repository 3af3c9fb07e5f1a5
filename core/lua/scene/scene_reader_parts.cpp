// Particles and the parameters of plugins, read from the records of the scene language.
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <limits>
#include <set>
#include <string_view>

#include "core/base/text.h"
#include "core/lua/lua_read.h"
#include "core/lua/lua_table.h"
#include "core/lua/scene/lua_function.h"
#include "core/lua/scene/scene_reader.h"

namespace sim {
namespace {

constexpr double kBytesPerParticle = 100;  // at least, of a running simulation

// Keys of a force that are no parameters: they say what it joins or acts on.
bool names_particles(const PluginInfo& plugin, const std::string& key) {
  return (plugin.elements.arity == 2 && (key == "grid" || key == "offsets")) ||
         (plugin.elements.cells && key == "cells") ||
         ((plugin.pointwise || plugin.elements.arity == 1) && key == "particles");
}

// True if it takes the key `on` or `stiff`, which belong to the scene and are no parameters.
bool takes_key(const PluginInfo& plugin, const std::string& key) {
  const bool force = plugin.kind == kind_of<Force>;
  const bool has_it =
      (key == "on" && (force || plugin.kind == kind_of<Collider>)) || (key == "stiff" && force);
  return has_it && std::ranges::count(plugin.params, key, &Param::name) == 0;
}

// A parameter as a plain value; which type it should have is for the plugin's declaration to say,
// but for functions, of which there are several kinds.
Value read_value(const std::shared_ptr<SceneSession>& session, lua_State* L, int dimension,
                 ParamType type, const SourceLocation& place, const std::string& what) {
  const int index = lua_absindex(L, -1);
  switch (lua_type(L, index)) {
    case LUA_TBOOLEAN:
      return static_cast<bool>(lua_toboolean(L, index));
    case LUA_TNUMBER:
      if (lua_isinteger(L, index)) return static_cast<std::int64_t>(lua_tointeger(L, index));
      return read_number(L, index, place, what);
    case LUA_TSTRING:
      return read_text(L, index, place, what);
    case LUA_TTABLE:
      return read_vector(L, index, place, what);
    case LUA_TFUNCTION:
      if (lua_iscfunction(L, index)) break;
      if (type == ParamType::kParticleFunction)
        return make_particle_function(session, L, index, what);
      if (type == ParamType::kCurve) return make_curve_function(session, L, index, what);
      if (type == ParamType::kMotion || type == ParamType::kPath)
        return make_motion_function(session, L, index, what);
      return make_ode_function(session, L, index, dimension);
    default:
      break;
  }
  scene_error(place, "bad " + what,
              "expected a number, text, true, false, a vector {x, y, z} or a function written in "
              "the scene, got " +
                  show(L, index));
}

// One entry of a list, on top of the stack, or all of them where it is a table.
void read_list(lua_State* L, const SourceLocation& place, const std::string& what, List& list) {
  constexpr lua_Unsigned kMost = 10000;
  if (lua_type(L, -1) == LUA_TNUMBER) {
    list.emplace_back(read_number(L, -1, place, what));
  } else if (lua_type(L, -1) == LUA_TSTRING) {
    list.emplace_back(read_text(L, -1, place, what));
  } else {
    if (!lua_istable(L, -1))
      scene_error(place, "bad " + what, "expected a list of numbers or texts, got " + show(L, -1));
    const lua_Unsigned count = lua_rawlen(L, -1);
    if (count > kMost)
      scene_error(place, "bad " + what, "it has more than " + std::to_string(kMost) + " entries");
    for (lua_Unsigned i = 1; i <= count; ++i) {
      lua_rawgeti(L, -1, static_cast<lua_Integer>(i));
      if (lua_type(L, -1) != LUA_TNUMBER && lua_type(L, -1) != LUA_TSTRING)
        scene_error(
            place, "bad " + what,
            "entry " + std::to_string(i) + " is to be a number or a text, got " + show(L, -1));
      read_list(L, place, what, list);
      lua_pop(L, 1);
    }
    lua_pushnil(L);
    if (lua_next(L, -2)) {
      lua_Unsigned keys = 0;
      do {
        ++keys;
        lua_pop(L, 1);
      } while (lua_next(L, -2));
      if (keys != count)
        scene_error(place, "bad " + what, "it has keys that are not 1, 2, 3 ...",
                    "write { entry, entry, .. }");
    }
  }
}

}  // namespace

namespace {

// Before any memory is taken for them.
void check_count(lua_Integer count, const SourceLocation& place) {
  if (count == 0)
    scene_error(place, "no particles", "none was added", "add one: particles:add {0, 0, 0}");
  if (count > std::numeric_limits<int>::max())
    scene_error(place, "too many particles", std::to_string(count) + " is more than 2^31 - 1");
  const double memory =
      static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
  if (const double need = kBytesPerParticle * static_cast<double>(count); need > memory)
    scene_error(place, "too many particles",
                std::to_string(count) + " need more than " +
                    std::to_string(static_cast<long>(need / 1e9)) + " GB, this machine has " +
                    std::to_string(static_cast<long>(memory / 1e9)) + " GB");
}

GridSpec read_grid(const LuaTable& record, const SourceLocation& place) {
  GridSpec grid;
  grid.size = {static_cast<int>(record.integer("n1")), static_cast<int>(record.integer("n2")),
               static_cast<int>(record.integer("n3"))};
  grid.directions = static_cast<int>(record.integer("directions"));
  grid.origin = record.vector("origin");
  grid.du = record.vector("du");
  grid.dv = record.vector("dv");
  grid.dw = record.vector("dw");
  grid.mass = record.number("mass");
  for (const double i : {0.0, grid.size[0] - 1.0})
    for (const double j : {0.0, grid.size[1] - 1.0})
      for (const double k : {0.0, grid.size[2] - 1.0})
        if (!(grid.origin + i * grid.du + j * grid.dv + k * grid.dw).allFinite())
          scene_error(place, "bad sim.grid", "a corner of it is not at a finite place");
  return grid;
}

// The numbers that particles carry, by name: of all of the grid and then of the list.
std::map<std::string, std::vector<double>> read_numbers(const LuaTable& record, lua_State* L,
                                                        lua_Integer first, lua_Integer count) {
  std::map<std::string, std::vector<double>> numbers;
  const LuaTable columns = record.table("numbers");
  for (lua_pushnil(L); lua_next(L, columns.index()); lua_pop(L, 1)) {
    const std::string name(lua_tostring(L, -2), lua_rawlen(L, -2));
    const LuaTable column(L, -1);
    const double otherwise = column.number("default");
    std::vector<double>& values = numbers[name];
    values.assign(static_cast<std::size_t>(count), otherwise);
    const LuaTable given = column.table("values");
    for (lua_Integer i = first; i < count; ++i)
      values[static_cast<std::size_t>(i)] = given.number(i - first + 1, otherwise);
  }
  return numbers;
}

std::set<std::string> words_of(std::string_view text) {
  const auto in_word = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_';
  };
  std::set<std::string> words;
  for (std::size_t at = 0; at < text.size();) {
    std::size_t end = at;
    while (end < text.size() && in_word(text[end])) ++end;
    if (end > at) words.emplace(text.substr(at, end - at));
    at = end + 1;
  }
  return words;
}

std::vector<ParticleSpec> read_list(const LuaTable& record) {
  const double mass = record.number("mass");
  const LuaTable x = record.table("x"), y = record.table("y"), z = record.table("z"),
                 vx = record.table("vx"), vy = record.table("vy"), vz = record.table("vz"),
                 masses = record.table("masses");
  std::vector<ParticleSpec> list(static_cast<std::size_t>(record.integer("count")));
  lua_Integer i = 0;
  for (ParticleSpec& particle : list) {
    ++i;
    particle.position = {x.number(i), y.number(i), z.number(i)};
    particle.velocity = {vx.number(i), vy.number(i), vz.number(i)};
    particle.mass = masses.number(i, mass);
  }
  return list;
}

}  // namespace

ParticlesSpec SceneReader::particles(lua_State* L, int index, const SourceLocation& place) const {
  const LuaTable record(L, index);
  const lua_Integer first = record.integer("first"), count = first + record.integer("count");
  check_count(count, place);
  session_->count(static_cast<double>(count), 0, place);

  ParticlesSpec spec;
  if (first > 0) spec.grid = read_grid(record, place);
  spec.list = read_list(record);
  const LuaTable grids = record.table("grids");
  for (lua_Integer i = 1; i <= grids.length(); ++i) {
    lua_rawgeti(L, grids.index(), i);
    const LuaTable added(L, -1);
    spec.added_grids.push_back(read_grid(added, session_->place(added.integer("place"))));
    spec.added_grids.back().first = static_cast<int>(added.integer("start"));
    lua_pop(L, 1);
  }
  spec.numbers = read_numbers(record, L, first, count);

  const LuaTable pins = record.table("pins");  // id, place, id, place, ...
  for (lua_Integer i = 1; i < pins.length(); i += 2) {
    const lua_Integer id = pins.integer(i);
    if (id >= count)
      scene_error(session_->place(pins.integer(i + 1)), "bad pin",
                  "there is no particle " + std::to_string(id),
                  "the ids of the scene are 0 to " + std::to_string(count - 1));
    spec.pinned.push_back(static_cast<int>(id));
  }
  prescribed(L, record, static_cast<int>(count), spec);
  std::sort(spec.pinned.begin(), spec.pinned.end());
  spec.pinned.erase(std::unique(spec.pinned.begin(), spec.pinned.end()), spec.pinned.end());
  return spec;
}

const GridSpec& SceneReader::grid(lua_State* L, int handle, const Body& body,
                                  const SourceLocation& place) const {
  const StackScope scope(L);
  const std::string kind = session_->push_record(L, handle);
  const LuaTable record(L, -1);
  if (kind == "added_grid") {
    push_field(L, record.index(), "on");
    require_own(L, -1, body, place, "grid");
    return *body.particles.grid_of(static_cast<int>(record.integer("start")));
  }
  if (kind != "particles")
    scene_error(place, "bad grid", "expected a sim.grid, got " + show(L, handle));
  require_own(L, handle, body, place, "grid");
  if (!body.particles.grid)
    scene_error(place, "bad grid", "expected a sim.grid, got a sim.particles",
                "use :tie, or make the particles with sim.grid or :add_grid");
  return *body.particles.grid;
}

// A number that no formula names may be a misspelt option.
void SceneReader::check_numbers(lua_State* L, int particles, const SystemSpec& spec) const {
  if (spec.particles->numbers.empty()) return;
  std::string formulas;
  for (const PartSpec& part : spec.forces) {
    if (!registry_.get<Force>(part.plugin, part.place).reads_particles) continue;
    for (const auto& [key, value] : part.given)
      if (const auto* text = std::get_if<std::string>(&value)) formulas += *text + ';';
  }
  const std::set<std::string> words = words_of(formulas);
  session_->push_record(L, particles);
  const LuaTable record(L, -1), columns = record.table("numbers");
  for (const auto& [name, values] : spec.particles->numbers) {
    if (words.contains(name) || words.contains(name + '1') || words.contains(name + '2')) continue;
    const LuaTable column = columns.table(name.c_str());
    scene_error(session_->place(column.integer("place")),
                "unknown key '" + one_line_text(name) + "' of particles",
                "it is no option, and no formula reads it as a number that they carry",
                suggestion(name, std::vector<std::string>{"mass", "velocity"}));
  }
}

void SceneReader::prescribed(lua_State* L, const LuaTable& record, int count,
                             ParticlesSpec& spec) const {
  const LuaTable prescribed = record.table("prescribed");  // id, path, place, id, ...
  std::set<lua_Integer> seen;
  for (lua_Integer i = 1; i < prescribed.length(); i += 3) {
    const lua_Integer id = prescribed.integer(i);
    const SourceLocation place = session_->place(prescribed.integer(i + 2));
    if (id >= count)
      scene_error(place, "bad lead", "there is no particle " + std::to_string(id),
                  "the ids of the scene are 0 to " + std::to_string(count - 1));
    if (!seen.insert(id).second)
      scene_error(place, "bad prescribe",
                  "particle " + std::to_string(id) + " is prescribed twice");
    lua_rawgeti(L, prescribed.index(), i + 1);
    Value path;
    if (!read_reference(L, -1, nullptr, place, path))
      path = read_value(session_, L, 1, ParamType::kMotion, place,
                        "path of particle " + std::to_string(id));
    lua_pop(L, 1);
    const int particle = static_cast<int>(id);
    spec.prescribed.push_back(
        {particle, std::get<std::shared_ptr<const RigidMotion>>(path), place});
    spec.pinned.push_back(particle);
  }
}

namespace {

// The unnamed entries 1 .. count of a table, which are the list that may be given without its name.
void read_entries(lua_State* L, int table, lua_Integer count, const PluginInfo& plugin,
                  PartSpec& spec) {
  const auto param = std::ranges::find_if(plugin.params, &Param::positional);
  const std::string what = "parameter '" + param->name + "' of " + plugin.title();
  if (spec.given.contains(param->name))
    scene_error(spec.place, plugin.title(), "'" + param->name + "' is given twice");
  List& list = spec.given[param->name].emplace<List>();
  for (lua_Integer i = 1; i <= count; ++i) {
    if (lua_rawgeti(L, table, i) == LUA_TNIL)
      scene_error(spec.place, "bad " + what, "entry " + std::to_string(i) + " is missing");
    if (lua_istable(L, -1))
      scene_error(
          spec.place, "bad " + what,
          "entry " + std::to_string(i) + " is to be a number or a text, got " + show(L, -1));
    read_list(L, spec.place, what, list);
    lua_pop(L, 1);
  }
}

}  // namespace

PartSpec SceneReader::part(lua_State* L, int index, const PluginInfo& plugin, int dimension,
                           Body* body) const {
  PartSpec spec;
  spec.plugin = plugin.name;
  spec.place = place_of(L, index);
  const std::string owner = plugin.title();
  constexpr int kDeepest = 1000;  // values on the stack; each part in a part has a few
  if (lua_gettop(L) > kDeepest)
    scene_error(spec.place, owner, "parts are nested too deeply in each other",
                "give numbers, or a part that stands for itself");

  const LuaTable record(L, index), given = record.table("given");
  lua_Integer unnamed = 0;  // entries of a list
  for (lua_pushnil(L); lua_next(L, given.index()); lua_pop(L, 1)) {
    StackScope::require_room(L);
    std::string name;
    if (lua_type(L, -2) == LUA_TSTRING) {
      name.assign(lua_tostring(L, -2), lua_rawlen(L, -2));
      if (names_particles(plugin, name)) continue;
      if (takes_key(plugin, name)) {
        if (!lua_isboolean(L, -1))
          scene_error(spec.place, "bad " + name + " of " + owner,
                      "expected true or false, got " + show(L, -1));
        const bool said = lua_toboolean(L, -1);
        if (name == "on")
          spec.on = said;
        else
          spec.stiff = said;
        continue;
      }
    } else {
      const auto positional = std::find_if(plugin.params.begin(), plugin.params.end(),
                                           [](const Param& param) { return param.positional; });
      const bool list = positional != plugin.params.end() && positional->type == ParamType::kList;
      if (list && lua_isinteger(L, -2) && lua_tointeger(L, -2) >= 1) {
        ++unnamed;
        continue;
      }
      if (positional == plugin.params.end() || !lua_isinteger(L, -2) || lua_tointeger(L, -2) != 1)
        scene_error(spec.place, owner, "every parameter has a name, found the key " + show(L, -2),
                    positional == plugin.params.end()
                        ? ""
                        : "only '" + positional->name + "' may be given without its name");
      name = positional->name;
    }
    if (spec.given.count(name)) scene_error(spec.place, owner, "'" + name + "' is given twice");

    // A name that is not declared is for Params to report, whatever its value.
    const auto param = std::find_if(plugin.params.begin(), plugin.params.end(),
                                    [&](const Param& p) { return p.name == name; });
    const bool known = param != plugin.params.end();
    if (!known) name = one_line_text(name);
    Value& value = spec.given[name];
    if (known && read_reference(L, -1, body, spec.place, value)) continue;
    if (known && param->type == ParamType::kList) {
      read_list(L, spec.place, "parameter '" + name + "' of " + owner, value.emplace<List>());
      continue;
    }
    if (known && param->type == ParamType::kColliders && lua_istable(L, -1)) {
      value = collider_list(L, spec.place, "parameter '" + name + "' of " + owner);
      continue;
    }
    if (known && param->type == ParamType::kBodies && lua_istable(L, -1)) {
      value = body_list(L, body, spec.place, "parameter '" + name + "' of " + owner);
      continue;
    }
    if (known || (plugin.free_numbers && lua_type(L, -1) == LUA_TNUMBER))
      value = read_value(session_, L, dimension, known ? param->type : ParamType::kNumber,
                         spec.place, "parameter '" + name + "' of " + owner);
  }
  if (unnamed > 0) read_entries(L, given.index(), unnamed, plugin, spec);
  return spec;
}

}  // namespace sim
