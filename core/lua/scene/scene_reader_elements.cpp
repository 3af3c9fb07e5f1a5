// Elements of forces - ties, surfaces, groups -, read from the records of the scene language.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include "core/base/memory.h"
#include "core/base/text.h"
#include "core/geometry/triangle_mesh.h"
#include "core/lua/lua_read.h"
#include "core/lua/lua_table.h"
#include "core/lua/scene/scene_reader.h"
#include "core/scene/part_text.h"
#include "core/session/identity.h"

namespace sim {
namespace {

std::string known_ids(const ParticlesSpec& particles) {
  return "the ids of the scene are 0 to " + std::to_string(particles.count() - 1);
}

// The whole numbers {di, dj} or {di, dj, dk}; on top of the stack.
std::array<int, 3> read_offset(lua_State* L, const GridSpec& grid, const SourceLocation& place,
                               const std::string& what) {
  const int offset = lua_absindex(L, -1);
  const char* const form = grid.directions == 3 ? "{di, dj, dk}" : "{di, dj}";
  const auto directions = static_cast<std::size_t>(grid.directions);
  if (!lua_istable(L, offset) || read_length(L, offset, place, what) != directions)
    scene_error(place, "bad " + what, std::string("expected ") + form + ", got " + show(L, offset));
  std::array<int, 3> step{};
  for (std::size_t axis = 0; axis < directions; ++axis) {
    lua_rawgeti(L, offset, static_cast<lua_Integer>(axis) + 1);
    const double value = read_number(L, -1, place, what);
    if (value != std::floor(value) || std::abs(value) > std::numeric_limits<int>::max())
      scene_error(place, "bad " + what,
                  std::string("expected whole numbers ") + form + ", got " + show(L, -1));
    step[axis] = static_cast<int>(value);
    lua_pop(L, 1);
  }
  if (step == std::array<int, 3>{})
    scene_error(place, "bad " + what, "it ties every particle to itself");
  return step;
}

bool same_pairs(const std::array<int, 3>& a, const std::array<int, 3>& b) {
  return a == b || (a[0] == -b[0] && a[1] == -b[1] && a[2] == -b[2]);
}

}  // namespace

void SceneReader::require_own(lua_State* L, int index, const Body& body,
                              const SourceLocation& place, const std::string& what) const {
  if (!lua_rawequal(L, index, body.handle))
    scene_error(place, "bad " + what, "it is not the particles of this scene");
}

Elements SceneReader::elements(lua_State* L, int index, const PluginInfo& plugin, const Body& body,
                               const SourceLocation& place) const {
  const LuaTable record(L, index);
  const lua_Integer count = record.integer("count"), arity = record.integer("arity");
  Elements elements;
  elements.arity = static_cast<int>(arity);
  elements.cells = plugin.elements.cells;
  if (plugin.elements.arity == 2) grid_pairs(L, index, body, place, elements.grids);
  if (plugin.elements.arity == 1) {
    elements.arity = 1;
    if (count > 0)
      scene_error(place, plugin.title(), "it takes no ties between particles",
                  "write particles = { ids }");
    if (const auto ids = group(L, index, body, place, true)) {
      elements.ids = *ids;
    } else {
      const LuaTable given = record.table("given");
      const bool all = push_field(L, given.index(), "particles") != LUA_TNIL;
      lua_pop(L, 1);
      for (int i = 0; all && i < body.particles.count(); ++i) elements.ids.push_back(i);
    }
    return elements;
  }
  if (elements.cells && cells(L, index, body, place, elements)) {
    if (count > 0)
      scene_error(place, "two kinds of cells", "it has both ties and cells", "leave one out");
    return elements;
  }
  if (count == 0) {
    elements.arity = std::max(plugin.elements.arity, 2);
    return elements;
  }

  const LuaTable places = record.table("places");
  const auto place_of_tie = [&](lua_Integer i) { return session_->place(places.integer(i)); };
  const std::string owner = plugin.title();
  if (plugin.elements.arity == 0)
    scene_error(place_of_tie(1), owner, "it takes no ties between particles");
  if (plugin.elements.arity != arity)
    scene_error(place_of_tie(1), std::string("bad ") + plugin.elements.name,
                owner + " joins " + std::to_string(plugin.elements.arity) +
                    " particles by each, not " + std::to_string(arity));

  // The particles that are joined.
  const LuaTable ids = record.table("ids"), points = record.table("points");
  session_->count(0, static_cast<double>(count), place);
  elements.ids.resize(static_cast<std::size_t>(count * arity));
  for (lua_Integer i = 0; i < count * arity; ++i) {
    const lua_Integer id = ids.integer(i + 1);
    if (id < 0) {
      lua_rawgeti(L, points.index(), i + 1);
      elements.ids[static_cast<std::size_t>(i)] =
          point(L, lua_gettop(L), body, place_of_tie(i / arity + 1));
      lua_pop(L, 1);
      continue;
    }
    if (id >= body.particles.count())
      scene_error(place_of_tie(i / arity + 1), std::string("bad ") + plugin.elements.name,
                  "there is no particle " + std::to_string(id), known_ids(body.particles));
    elements.ids[static_cast<std::size_t>(i)] = static_cast<int>(id);
  }

  // The values that elements give themselves.
  std::vector<std::string> known;
  for (const Param& param : plugin.params)
    if (param.per_tie) known.push_back(param.name);
  const LuaTable values = record.table("values");
  for (lua_pushnil(L); lua_next(L, values.index()); lua_pop(L, 1)) {
    const std::string name(lua_tostring(L, -2), lua_rawlen(L, -2));
    const LuaTable column(L, -1);
    const auto param = std::ranges::find(plugin.params, name, &Param::name);
    const bool declared = param != plugin.params.end() && param->per_tie;
    std::vector<double>& own = elements.values[name];
    own.resize(static_cast<std::size_t>(count));
    for (lua_Integer i = 1; i <= count; ++i) {
      const double value = column.number(i, std::nan(""));
      own[static_cast<std::size_t>(i - 1)] = value;
      if (std::isnan(value)) continue;
      if (!declared && plugin.free_numbers) continue;
      if (!declared)
        scene_error(place_of_tie(i),
                    "unknown key '" + one_line_text(name) + "' in the options of a " +
                        std::string(plugin.elements.name),
                    "it is not used there", suggestion(name, known));
      if (const std::string why = objection(value, *param); !why.empty())
        scene_error(place_of_tie(i), "bad " + name + " of a " + std::string(plugin.elements.name),
                    "it is " + shortest(value), why);
    }
  }
  return elements;
}

void SceneReader::grid_pairs(lua_State* L, int index, const Body& body, const SourceLocation& place,
                             std::vector<GridPairs>& out) const {
  const LuaTable record(L, index), given = record.table("given");
  const bool has_grid = push_field(L, given.index(), "grid") != LUA_TNIL;
  const int handle = lua_gettop(L);
  const bool has_offsets = push_field(L, given.index(), "offsets") != LUA_TNIL;
  const int offsets = lua_gettop(L);
  if (has_grid != has_offsets)
    scene_error(place, has_grid ? "missing 'offsets'" : "missing 'grid'",
                "grid and offsets go together",
                "write grid = particles, offsets = { {0, 1}, {1, 0} }");
  if (!has_grid) return;
  if (!lua_istable(L, handle) || !session_->push_record(L, handle).empty())
    return offset_pairs(L, grid(L, handle, body, place), offsets, place, out);
  const std::size_t count = read_length(L, handle, place, "grid");
  std::set<int> seen;
  for (std::size_t i = 1; i <= count; ++i) {
    lua_rawgeti(L, handle, static_cast<lua_Integer>(i));
    const GridSpec& each = grid(L, lua_gettop(L), body, place);
    lua_pop(L, 1);
    if (!seen.insert(each.first).second)
      scene_error(place, "bad grid", "entry " + std::to_string(i) + " is a grid before it");
    offset_pairs(L, each, offsets, place, out);
  }
}

void SceneReader::offset_pairs(lua_State* L, const GridSpec& grid, int offsets,
                               const SourceLocation& place, std::vector<GridPairs>& out) const {
  const std::size_t count = read_length(L, offsets, place, "offsets"), before = out.size();
  if (count == 0)
    scene_error(place, "bad offsets", "the list is empty", "write offsets = { {0, 1}, {1, 0} }");
  for (std::size_t i = 0; i < count; ++i) {
    const std::string what = "offset " + std::to_string(i + 1);
    lua_rawgeti(L, offsets, static_cast<lua_Integer>(i) + 1);
    const std::array<int, 3> step = read_offset(L, grid, place, what);
    lua_pop(L, 1);
    GridPairs pairs{grid.first, grid.size, step,
                    (step[0] * grid.du + step[1] * grid.dv + step[2] * grid.dw).stableNorm()};
    if (!std::isfinite(pairs.length))
      scene_error(place, "bad " + what, "its rest length is not finite");
    // Beyond the grid there is nothing to tie; the clamp keeps index arithmetic within int.
    for (std::size_t axis = 0; axis < 3; ++axis)
      pairs.step[axis] = std::clamp(step[axis], -grid.size[axis], grid.size[axis]);
    for (const GridPairs& other : std::span(out).subspan(before))
      if (same_pairs(other.step, pairs.step))
        scene_error(place, "bad " + what, "the same pairs are tied by an offset before it");
    session_->count(0, static_cast<double>(pairs.count()), place);
    out.push_back(pairs);
  }
}

std::optional<std::vector<int>> SceneReader::group(lua_State* L, int index, const Body& body,
                                                   const SourceLocation& place, bool points) const {
  const LuaTable record(L, index), given = record.table("given");
  if (push_field(L, given.index(), "particles") == LUA_TNIL) return {};
  const int list = lua_gettop(L);
  if (const std::string kind = session_->push_record(L, list); kind == "particles") {
    require_own(L, list, body, place, "particles");
    return {};
  } else if (kind == "added_grid") {
    const GridSpec& added = grid(L, list, body, place);
    std::vector<int> ids(static_cast<std::size_t>(added.count()));
    std::iota(ids.begin(), ids.end(), added.first);
    return ids;
  } else if (!kind.empty()) {
    scene_error(place, "bad particles", "expected a list of ids, got a sim." + kind);
  }
  std::vector<int> ids;
  const std::size_t count = read_length(L, list, place, "particles");
  for (std::size_t i = 1; i <= count; ++i) {
    lua_rawgeti(L, list, static_cast<lua_Integer>(i));
    if (points && lua_istable(L, -1)) {
      ids.push_back(point(L, lua_gettop(L), body, place));
      lua_pop(L, 1);
      continue;
    }
    const double id = read_number(L, -1, place, "id " + std::to_string(i) + " of particles");
    if (!(id >= 0 && id < body.particles.count() && id == std::floor(id)))
      scene_error(place, "bad id " + std::to_string(i) + " of particles",
                  "there is no particle " + show(L, -1), known_ids(body.particles));
    ids.push_back(static_cast<int>(id));
    lua_pop(L, 1);
  }
  std::ranges::sort(ids);
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return ids;
}

// Parameters that name another part of the scene.
bool SceneReader::read_reference(lua_State* L, int index, Body* body, const SourceLocation& place,
                                 Value& out) const {
  const StackScope scope(L);
  const int value = lua_absindex(L, index);
  const std::string kind = session_->push_record(L, value);
  if (kind == "surface") {
    if (!body) scene_error(place, "bad surface", "only forces between particles know surfaces");
    out = surface(L, value, lua_absindex(L, -1), *body);
  } else if (kind == "motion") {
    out = motion(L, lua_absindex(L, -1));
  } else if (kind == "law") {
    out = law(L, lua_absindex(L, -1));
  } else if (kind == "collider") {
    out = collider(L, lua_absindex(L, -1));
  } else if (kind == "rigid") {
    out = Bodies{known_body(L, value, body, place, "body")};
  } else if (!kind.empty()) {
    scene_error(place, "bad parameter", "expected a value or a sim.surface, got a sim." + kind);
  }
  return !kind.empty();
}

template <class Object>
std::shared_ptr<const Object> SceneReader::made_once(lua_State* L, int record) const {
  push_field(L, record, "plugin");
  const SourceLocation place = place_of(L, record);
  const auto& plugin = registry_.get<Object>(lua_tostring(L, -1), place);
  lua_pop(L, 1);
  const PartSpec spec = part(L, record, plugin, 1, nullptr);
  return of_scene(place, [&] {
    return made(plugin.make(Params(plugin.title(), plugin.params, spec.given, place)), plugin);
  });
}

std::shared_ptr<const RigidMotion> SceneReader::motion(lua_State* L, int record) const {
  return made_once<RigidMotion>(L, record);
}

std::shared_ptr<const ContactLaw> SceneReader::law(lua_State* L, int record) const {
  return made_once<ContactLaw>(L, record);
}

std::shared_ptr<const ColliderMaker> SceneReader::collider(lua_State* L, int record) const {
  push_field(L, record, "plugin");
  const SourceLocation place = place_of(L, record);
  const auto& plugin = registry_.get<Collider>(lua_tostring(L, -1), place);
  lua_pop(L, 1);
  const PartSpec spec = part(L, record, plugin, 1, nullptr);
  auto maker = std::make_shared<ColliderMaker>();
  const Params params(plugin.title(), plugin.params, spec.given, place);
  maker->text = collider_text(plugin.name, spec.given);
  // A scene outlives the registry that it was read with.
  maker->make = [plugin = plugin, params, place] {
    return of_scene(place, [&] { return made(plugin.make(params), plugin); });
  };
  maker->make();  // errors are reported here
  return maker;
}

// On top of the stack.
Colliders SceneReader::collider_list(lua_State* L, const SourceLocation& place,
                                     const std::string& what) const {
  Colliders colliders;
  const int list = lua_gettop(L);
  const std::size_t count = read_length(L, list, place, what);
  for (std::size_t i = 1; i <= count; ++i) {
    lua_rawgeti(L, list, static_cast<lua_Integer>(i));
    if (session_->push_record(L, lua_gettop(L)) != "collider")
      scene_error(place, "bad entry " + std::to_string(i) + " of " + what,
                  "expected a sim.collider.NAME { ... }, got " + show(L, list + 1));
    colliders.push_back(collider(L, lua_gettop(L)));
    lua_settop(L, list);
  }
  return colliders;
}

// Each is compiled once, however many parts name it.
std::shared_ptr<const TriangleMesh> SceneReader::surface(lua_State* L, int handle, int index,
                                                         Body& body) const {
  std::shared_ptr<const TriangleMesh>& known = body.surfaces[lua_topointer(L, handle)];
  if (known) return known;
  const LuaTable record(L, index);
  const SourceLocation place = place_of(L, index);
  push_field(L, index, "on");
  const int on = lua_gettop(L);

  std::vector<TriangleMesh::Triangle> triangles;
  if (record.flag("grid")) {
    const GridSpec& grid = this->grid(L, on, body, place);
    const double count = 2.0 * grid.count();  // of a sheet; a block has fewer
    session_->count(0, count, place);
    constexpr double kEach = 60;  // bytes of a triangle, with its edges
    if (grid.size[2] == 1)
      require_memory(kEach * count, "its triangles need", place, "make the grid smaller");
    triangles = grid.triangles();
  } else {
    require_own(L, on, body, place, "surface");
    const LuaTable ids = record.table("ids");
    for (lua_Integer i = 0; i + 2 < ids.length(); i += 3) {
      TriangleMesh::Triangle& triangle = triangles.emplace_back();
      for (lua_Integer corner = 0; corner < 3; ++corner)
        triangle[static_cast<std::size_t>(corner)] = static_cast<int>(ids.integer(i + corner + 1));
    }
  }

  known = of_scene(place, [&] {
    return std::make_shared<const TriangleMesh>(body.particles.count(), std::move(triangles));
  });
  const int flat = flat_triangle(*known, [&](int id) { return body.particles.at(id).position; });
  if (flat >= 0)
    scene_error(place, "bad triangle " + std::to_string(flat + 1) + " of a surface",
                "it has no area where its particles start");
  return known;
}

std::vector<std::shared_ptr<const TriangleMesh>> SceneReader::surfaces(
    lua_State* L, int scene, Body& body, const SystemSpec& spec) const {
  // The surfaces that the scene lists, then those that only forces name.
  std::vector<std::shared_ptr<const TriangleMesh>> list;
  const auto add = [&](const std::shared_ptr<const TriangleMesh>& surface) {
    if (std::ranges::find(list, surface) == list.end()) list.push_back(surface);
  };
  if (push_field(L, scene, "surfaces") != LUA_TNIL) {
    const int table = lua_gettop(L);
    const std::size_t count = read_length(L, table, spec.place, "surfaces");
    for (std::size_t i = 1; i <= count; ++i) {
      lua_rawgeti(L, table, static_cast<lua_Integer>(i));
      const int handle = lua_gettop(L);
      if (session_->push_record(L, handle) != "surface")
        scene_error(spec.place, "bad entry " + std::to_string(i) + " of surfaces",
                    "expected a sim.surface { ... }, got " + show(L, handle));
      add(surface(L, handle, lua_gettop(L), body));
      lua_settop(L, table);
    }
  }
  lua_pop(L, 1);
  for (const PartSpec& force : spec.forces)
    for (const auto& [name, value] : force.given)
      if (const auto* surface = std::get_if<std::shared_ptr<const TriangleMesh>>(&value))
        add(*surface);
  return list;
}

void SceneReader::contact(lua_State* L, int scene, Body& body, SystemSpec& spec) const {
  const int top = lua_gettop(L);
  if (push_field(L, scene, "contact") != LUA_TNIL) {
    const int handle = lua_gettop(L);
    if (session_->push_record(L, handle) != "contact")
      scene_error(spec.place, "bad contact",
                  "expected a sim.contact { ... }, got " + show(L, handle));
    const int record = lua_gettop(L);
    const SourceLocation place = place_of(L, record);
    push_field(L, record, "plugin");
    const auto& plugin = registry_.get<StepCorrection>(lua_tostring(L, -1), place);
    ContactSpec& contact = spec.contact.emplace();
    contact.plugin = plugin.name;
    contact.place = place;
    const auto given = part(L, record, plugin, 1, &body).given;
    const Params params(plugin.title(), plugin.params, given, place);
    for (const Param& param : plugin.params)
      if (const Value& value = params.value(param.name);
          digest(value) != digest(param.default_value))
        contact.given[param.name] = value;
    const LuaTable written(L, record), list = written.table("surfaces");
    for (lua_Integer i = 1; i <= list.length(); ++i) {
      lua_rawgeti(L, list.index(), i);
      const int each = lua_gettop(L);
      session_->push_record(L, each);
      contact.surfaces.push_back(surface(L, each, lua_gettop(L), body));
      lua_settop(L, each - 1);
    }
    for (const auto& one : contact.surfaces)
      if (std::ranges::find(spec.surfaces, one) == spec.surfaces.end())
        spec.surfaces.push_back(one);
  }
  lua_settop(L, top);
}

}  // namespace sim
