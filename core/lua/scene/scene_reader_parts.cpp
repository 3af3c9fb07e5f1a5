// Particles, plugins' parameters and ties, read from the records of the scene language.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/text.h"
#include "core/lua/lua_read.h"
#include "core/lua/scene/lua_function.h"
#include "core/lua/scene/scene_reader.h"

namespace sim {
namespace {

constexpr double kBytesPerParticle = 100;  // at least, of a running simulation
constexpr const char* kLinkKeys[] = {"grid", "offsets"};

// Number t[i], which the language has checked; `otherwise` for nil.
double number_at(lua_State* L, int table, lua_Integer i, double otherwise = 0) {
  const double value = lua_rawgeti(L, table, i) == LUA_TNUMBER ? lua_tonumber(L, -1) : otherwise;
  lua_pop(L, 1);
  return value;
}

lua_Integer integer_field(lua_State* L, int table, const char* key) {
  push_field(L, table, key);
  const lua_Integer value = lua_tointeger(L, -1);
  lua_pop(L, 1);
  return value;
}

Vec3 vector_field(lua_State* L, int table, const char* key) {
  push_field(L, table, key);
  const int vector = lua_absindex(L, -1);
  const Vec3 value(number_at(L, vector, 1), number_at(L, vector, 2), number_at(L, vector, 3));
  lua_pop(L, 1);
  return value;
}

// |d| without overflow or underflow of the squares.
double length(const Vec3& d) {
  const double square = d.x() * d.x() + d.y() * d.y() + d.z() * d.z();
  if (square > 1e-290 && square < 1e290) return std::sqrt(square);
  const double scale = d.cwiseAbs().maxCoeff();
  if (scale == 0) return 0;
  const Vec3 e = d / scale;
  return scale * std::sqrt(e.x() * e.x() + e.y() * e.y() + e.z() * e.z());
}

// A parameter as a plain value; which type it should have is for the plugin's declaration to say,
// but for functions, of which `of_particles` wants another kind.
Value read_value(const std::shared_ptr<SceneSession>& session, lua_State* L, int dimension,
                 bool of_particles, const Place& place, const std::string& what) {
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
      if (of_particles) return make_particle_function(session, L, index, what);
      return make_ode_function(session, L, index, dimension);
    default:
      break;
  }
  scene_error(place, "bad " + what,
              "expected a number, text, true, false, a vector {x, y, z} or a function written in "
              "the scene, got " +
                  show(L, index));
}

}  // namespace

ParticlesSpec SceneReader::particles(lua_State* L, int record, const Place& place) const {
  ParticlesSpec spec;
  const lua_Integer added = integer_field(L, record, "count"),
                    first = integer_field(L, record, "first"), count = first + added;

  // Size, before any memory is taken for it.
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

  if (first > 0) {
    GridSpec& grid = spec.grid.emplace();
    grid.rows = static_cast<int>(integer_field(L, record, "rows"));
    grid.cols = static_cast<int>(integer_field(L, record, "cols"));
    grid.origin = vector_field(L, record, "origin");
    grid.du = vector_field(L, record, "du");
    grid.dv = vector_field(L, record, "dv");
    push_field(L, record, "mass");
    grid.mass = lua_tonumber(L, -1);
    lua_pop(L, 1);
    for (const double i : {0.0, grid.rows - 1.0})
      for (const double j : {0.0, grid.cols - 1.0})
        if (!(grid.origin + i * grid.du + j * grid.dv).allFinite())
          scene_error(place, "bad sim.grid", "a corner of it is not at a finite place");
  }

  const int top = lua_gettop(L);
  push_field(L, record, "mass");
  const double mass = lua_tonumber(L, -1);
  for (const char* key : {"x", "y", "z", "vx", "vy", "vz", "masses"}) push_field(L, record, key);
  spec.list.resize(static_cast<std::size_t>(added));
  for (lua_Integer i = 1; i <= added; ++i) {
    ParticleSpec& particle = spec.list[static_cast<std::size_t>(i - 1)];
    for (int axis = 0; axis < 3; ++axis) {
      particle.position[axis] = number_at(L, top + 2 + axis, i);
      particle.velocity[axis] = number_at(L, top + 5 + axis, i);
    }
    particle.mass = number_at(L, top + 8, i, mass);
  }

  push_field(L, record, "pins");
  const int pins = lua_absindex(L, -1);
  const auto entries = static_cast<lua_Integer>(lua_rawlen(L, pins));
  for (lua_Integer i = 1; i < entries; i += 2) {
    const double id = number_at(L, pins, i);
    if (id >= static_cast<double>(count)) {
      lua_rawgeti(L, pins, i + 1);
      scene_error(session_->place(lua_tointeger(L, -1)), "bad pin",
                  "there is no particle " + shortest(id),
                  "the ids of the scene are 0 to " + std::to_string(count - 1));
    }
    spec.pinned.push_back(static_cast<int>(id));
  }
  std::sort(spec.pinned.begin(), spec.pinned.end());
  spec.pinned.erase(std::unique(spec.pinned.begin(), spec.pinned.end()), spec.pinned.end());
  lua_settop(L, top);
  return spec;
}

PartSpec SceneReader::part(lua_State* L, int record, const PluginInfo& plugin,
                           int dimension) const {
  PartSpec spec;
  spec.plugin = plugin.name;
  spec.place = place_of(L, record);
  const std::string owner = std::string(kind_name(plugin.kind)) + " '" + plugin.name + "'";
  const bool links = plugin.kind == PluginKind::kForce && plugin.takes_links;

  push_field(L, record, "given");
  const int given = lua_absindex(L, -1);
  for (lua_pushnil(L); lua_next(L, given); lua_pop(L, 1)) {
    std::string name;
    if (lua_type(L, -2) == LUA_TSTRING) {
      name.assign(lua_tostring(L, -2), lua_rawlen(L, -2));
      if (links &&
          std::find(std::begin(kLinkKeys), std::end(kLinkKeys), name) != std::end(kLinkKeys))
        continue;
    } else {
      const auto positional = std::find_if(plugin.params.begin(), plugin.params.end(),
                                           [](const Param& param) { return param.positional; });
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
    if (known || (plugin.free_numbers && lua_type(L, -1) == LUA_TNUMBER))
      spec.given[name] = read_value(session_, L, dimension,
                                    known && param->type == ParamType::kParticleFunction,
                                    spec.place, "parameter '" + name + "' of " + owner);
    else
      spec.given[name] = Value{};
  }
  lua_pop(L, 1);
  Params(owner, plugin.params, spec.given, spec.place, plugin.free_numbers);
  return spec;
}

Links SceneReader::links(lua_State* L, int record, const ParticlesSpec& particles, int handle,
                         const PartSpec& part) const {
  Links links;
  const int top = lua_gettop(L);
  push_field(L, record, "given");
  const int given = lua_absindex(L, -1);
  const bool grid = push_field(L, given, "grid") != LUA_TNIL;
  const bool offsets = push_field(L, given, "offsets") != LUA_TNIL;
  if (grid != offsets)
    scene_error(part.place, grid ? "missing 'offsets'" : "missing 'grid'",
                "grid and offsets go together",
                "write grid = particles, offsets = { {0, 1}, {1, 0} }");
  if (grid) {
    if (session_->push_record(L, top + 2) != "particles")
      scene_error(part.place, "bad grid", "expected a sim.grid, got " + show(L, top + 2));
    if (!lua_rawequal(L, top + 2, handle))
      scene_error(part.place, "bad grid", "it is not the particles of this scene");
    if (!particles.grid)
      scene_error(part.place, "bad grid", "expected a sim.grid, got a sim.particles",
                  "use :tie, or make the particles with sim.grid");
    grid_links(L, top + 3, *particles.grid, part.place, links.grids);
  }
  lua_settop(L, top);

  for (const char* key : {"ties", "stiffness", "rest", "damping"}) push_field(L, record, key);
  const lua_Integer count = integer_field(L, record, "count");
  const double none = std::nan("");
  links.ties.resize(static_cast<std::size_t>(count));
  for (lua_Integer i = 1; i <= count; ++i) {
    const double a = number_at(L, top + 1, 3 * i - 2), b = number_at(L, top + 1, 3 * i - 1);
    if (const double last = std::max(a, b); last >= static_cast<double>(particles.count())) {
      lua_rawgeti(L, top + 1, 3 * i);
      scene_error(session_->place(lua_tointeger(L, -1)), "bad tie",
                  "there is no particle " + shortest(last),
                  "the ids of the scene are 0 to " + std::to_string(particles.count() - 1));
    }
    links.ties[static_cast<std::size_t>(i - 1)] = {
        static_cast<int>(a), static_cast<int>(b), number_at(L, top + 2, i, none),
        number_at(L, top + 3, i, none), number_at(L, top + 4, i, none)};
  }
  lua_settop(L, top);
  return links;
}

void SceneReader::grid_links(lua_State* L, int offsets, const GridSpec& grid, const Place& place,
                             std::vector<GridLinks>& out) const {
  const std::size_t count = read_length(L, offsets, place, "offsets");
  if (count == 0)
    scene_error(place, "bad offsets", "the list is empty", "write offsets = { {0, 1}, {1, 0} }");
  for (std::size_t i = 0; i < count; ++i) {
    lua_rawgeti(L, offsets, static_cast<lua_Integer>(i) + 1);
    const std::string what = "offset " + std::to_string(i + 1);
    const int offset = lua_absindex(L, -1);
    if (!lua_istable(L, offset) || read_length(L, offset, place, what) != 2)
      scene_error(place, "bad " + what, "expected {di, dj}, got " + show(L, offset));
    int d[2];
    for (int axis = 0; axis < 2; ++axis) {
      lua_rawgeti(L, offset, axis + 1);
      const double value = read_number(L, -1, place, what);
      if (value != std::floor(value) || std::abs(value) > std::numeric_limits<int>::max())
        scene_error(place, "bad " + what, "expected whole numbers {di, dj}, got " + show(L, -1));
      d[axis] = static_cast<int>(value);
    }
    lua_settop(L, offset - 1);
    if (d[0] == 0 && d[1] == 0)
      scene_error(place, "bad " + what, "{0, 0} ties every particle to itself");
    const double rest = length(d[0] * grid.du + d[1] * grid.dv);
    if (!std::isfinite(rest)) scene_error(place, "bad " + what, "its rest length is not finite");

    // Beyond the grid there is nothing to tie; the clamp keeps index arithmetic within int.
    const GridLinks link{0,
                         grid.rows,
                         grid.cols,
                         std::clamp(d[0], -grid.rows, grid.rows),
                         std::clamp(d[1], -grid.cols, grid.cols),
                         rest};
    for (const GridLinks& other : out)
      if ((other.di == link.di && other.dj == link.dj) ||
          (other.di == -link.di && other.dj == -link.dj))
        scene_error(place, "bad " + what, "the same pairs are tied by an offset before it");
    out.push_back(link);
  }
}

}  // namespace sim
