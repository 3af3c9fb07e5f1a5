#include "core/lua/scene/scene_reader.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "core/base/text.h"
#include "core/lua/lua_read.h"
#include "core/lua/scene/look_reader.h"
#include "core/lua/scene/lua_function.h"
#include "core/lua/scene/observer.h"
#include "core/picture/look.h"
#include "core/study/budget.h"

namespace sim {
namespace {

const std::vector<std::string> kSceneKeys = {
    "name",        "particles", "bodies",   "forces", "surfaces", "colliders", "accuracy",
    "constraints", "contact",   "switches", "state",  "field",    "exact",     "observe",
    "integrator",  "dt",        "duration", "error",  "sleep",    "look"};

bool plain_word(const std::string& name, const char* also) {
  return !name.empty() && name.size() <= 64 && std::all_of(name.begin(), name.end(), [&](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view(also).find(c) != std::string_view::npos;
  });
}

// A short description of a value given where a part was expected.
std::string shown_part(lua_State* L, int index, const std::string& kind) {
  if (kind == "added_grid") return "a part of one";
  if (!kind.empty()) return "a sim." + kind;
  if (lua_isfunction(L, index)) return "a function (write sim.force.NAME { ... })";
  return show(L, index);
}

void require_key(int type, const SourceLocation& place, const std::string& key,
                 const std::string& remedy) {
  if (type == LUA_TNIL)
    scene_error(place, "missing '" + key + "'", "sim.scene needs it", "write " + remedy);
}

// State of points, { x = {{x, y, z}, ...} }, or a flat list.
void read_state(lua_State* L, int index, const SourceLocation& place, FirstOrderSpec& spec) {
  index = lua_absindex(L, index);
  if (!lua_istable(L, index))
    scene_error(place, "bad state",
                "expected { x = {{x, y, z}, ...} } or a list of numbers, got " + show(L, index));
  const bool points = lua_rawlen(L, index) == 0;
  if (points) {
    read_keys(L, index, {"x"}, place, "state");
    push_field(L, index, "x");
    index = lua_absindex(L, -1);
  }
  const std::size_t count = lua_isnil(L, index) ? 0 : read_length(L, index, place, "state");
  if (count == 0)
    scene_error(place, "bad state", "it is empty",
                "write state = { x = {{1, 0, 0}} } or state = {1, 0}");
  if (count > 700'000'000) scene_error(place, "bad state", "it has more than 700 million entries");

  spec.dimension = points ? 3 : 1;
  spec.state.reserve(count * static_cast<std::size_t>(spec.dimension));
  for (std::size_t i = 0; i < count; ++i) {
    lua_rawgeti(L, index, static_cast<lua_Integer>(i) + 1);
    const std::string what = "entry " + std::to_string(i + 1) + " of state";
    if (points) {
      const Vec3 x = read_vector(L, -1, place, what);
      spec.state.insert(spec.state.end(), {x[0], x[1], x[2]});
    } else {
      spec.state.push_back(read_number(L, -1, place, what));
    }
    lua_pop(L, 1);
  }
}

}  // namespace

SourceLocation SceneReader::place_of(lua_State* L, int record) const {
  push_field(L, record, "place");
  const SourceLocation place = session_->place(lua_tointeger(L, -1));
  lua_pop(L, 1);
  return place;
}

SceneSpec SceneReader::read(lua_State* L) const {
  const int value = lua_absindex(L, -1);
  const std::string kind = session_->push_record(L, value);
  if (kind != "scene" && kind != "world")
    scene_error(session_->file(), "not a scene",
                "the file returned " + (kind.empty() ? show(L, value) : "a sim." + kind),
                "end it with return sim.scene { ... } or return sim.world { ... }");
  const SourceLocation place = place_of(L, -1);
  SceneSpec spec;
  spec.file = session_->file();
  spec.world = kind == "world";
  if (spec.world)
    spec.systems = world(L, value, place);
  else
    spec.systems.push_back(system(L, value, place));
  spec.args = session_->args();
  spec.inputs = session_->inputs();
  spec.notes = session_->notes();
  check_ties(L);
  return spec;
}

// A force that was tied and is in no scene would do nothing.
void SceneReader::check_ties(lua_State* L) const {
  session_->push_tied(L);
  const int list = lua_absindex(L, -1);
  for (lua_Integer i = 1; lua_rawgeti(L, list, i) != LUA_TNIL; ++i) {
    session_->push_record(L, -1);
    const int record = lua_absindex(L, -1);
    if (push_field(L, record, "used") == LUA_TNIL) {
      push_field(L, record, "plugin");
      const std::string name = lua_tostring(L, -1);
      push_field(L, record, "kind");
      const std::string kind = lua_tostring(L, -1);
      scene_error(place_of(L, record), "unused " + kind + " '" + name + "'",
                  "it is tied, but no scene has it", "put it into " + kind + "s = { ... }");
    }
    lua_settop(L, list);
  }
  lua_settop(L, list - 1);
}

std::vector<SystemSpec> SceneReader::world(lua_State* L, int scenes,
                                           const SourceLocation& place) const {
  std::vector<std::string> names;
  for (lua_pushnil(L); lua_next(L, scenes); lua_pop(L, 1)) {
    if (lua_type(L, -2) != LUA_TSTRING)
      scene_error(place, "bad key in sim.world",
                  "every scene has a name, found the key " + show(L, -2),
                  "write sim.world { left = ..., right = ... }");
    names.emplace_back(lua_tostring(L, -2), lua_rawlen(L, -2));
    if (!plain_word(names.back(), "_-"))
      scene_error(place, "bad name in sim.world",
                  "expected letters, digits, _ and -, got " + show(L, -2));
  }
  if (names.empty())
    scene_error(place, "empty sim.world", "it has no scene",
                "write sim.world { left = require \"scenes.circle\" }");
  std::sort(names.begin(), names.end());

  std::vector<SystemSpec> systems;
  for (const std::string& name : names) {
    push_field(L, scenes, name.c_str());
    const int scene = lua_absindex(L, -1);
    const std::string kind = session_->push_record(L, scene);
    if (kind != "scene")
      scene_error(place, "bad scene '" + name + "' in sim.world",
                  "expected a sim.scene, got " + shown_part(L, scene, kind),
                  kind == "world" ? "worlds cannot be nested: name their scenes one by one" : "");
    systems.push_back(system(L, scene, place_of(L, -1)));
    systems.back().name = name;
    lua_settop(L, scene - 1);
  }
  return systems;
}

SystemSpec SceneReader::system(lua_State* L, int scene, const SourceLocation& place) const {
  const std::vector<std::string> keys = read_keys(L, scene, kSceneKeys, place, "sim.scene");
  const auto has = [&](const char* key) {
    return std::find(keys.begin(), keys.end(), key) != keys.end();
  };
  SystemSpec spec;
  spec.place = place;

  // Name, integrator and time.
  spec.name = file_stem(place);
  for (char& c : spec.name)
    if (!plain_word({c}, "_-. ")) c = '_';
  if (push_field(L, scene, "name") != LUA_TNIL) spec.name = read_text(L, -1, place, "name");
  if (has("name") && !plain_word(spec.name, "_-. "))
    scene_error(place, "bad name",
                "expected letters, digits, spaces, _, - and ., got " + show(L, -1));
  require_key(push_field(L, scene, "integrator"), place, "integrator", "integrator = \"rk4\"");
  integrator(L, spec);
  require_key(push_field(L, scene, "dt"), place, "dt", "dt = 0.01, the step size in s");
  if (spec.dt = read_number(L, -1, place, "dt"); spec.dt <= 0)
    scene_error(place, "bad dt", "expected a step size > 0 s, got " + show(L, -1));
  require_key(push_field(L, scene, "duration"), place, "duration", "duration = 10, in s");
  if (spec.duration = read_number(L, -1, place, "duration"); spec.duration < 0)
    scene_error(place, "bad duration", "expected a time >= 0 s, got " + show(L, -1));
  lua_pop(L, 4);
  if (push_field(L, scene, "error") != LUA_TNIL) spec.error = allowed_error(L, place);
  if (push_field(L, scene, "sleep") != LUA_TNIL) spec.sleep = sleep(L, place);
  lua_pop(L, 2);

  // Either particles with forces or a state with a field.
  const bool second = has("particles") || has("bodies") || has("forces") || has("surfaces") ||
                      has("colliders") || has("constraints"),
             first = has("state") || has("field");
  if (second && first)
    scene_error(place, "a scene of two kinds",
                std::string("it has ") +
                    (has("particles")   ? "particles"
                     : has("bodies")    ? "bodies"
                     : has("forces")    ? "forces"
                     : has("surfaces")  ? "surfaces"
                     : has("colliders") ? "colliders"
                                        : "constraints") +
                    " and " + (has("state") ? "state" : "field"),
                "give particles and forces (second order), or state and field (first order)");
  if (!second && !first)
    scene_error(place, "an empty scene", "it has neither particles nor state",
                "give particles and forces (second order), or state and field (first order)");
  std::size_t size = 0;
  int dimension = 3;
  if (second) {
    second_order(L, scene, spec);
    size = 3 * static_cast<std::size_t>(spec.particles->count());
  } else {
    first_order(L, scene, spec);
    size = spec.first_order->state.size();
    dimension = spec.first_order->dimension;
  }

  spec.one_thread = session_->called();

  if (const int type = push_field(L, scene, "exact"); type == LUA_TFUNCTION)
    spec.exact = make_exact(session_, L, lua_absindex(L, -1), size, dimension);
  else if (type != LUA_TNIL)
    scene_error(place, "bad exact", "expected function(t), got " + show(L, -1));
  lua_pop(L, 1);

  if (push_field(L, scene, "observe") != LUA_TNIL)
    spec.observers = read_observers(session_, L, lua_absindex(L, -1), place);
  if (push_field(L, scene, "look") != LUA_TNIL)
    spec.look = read_look(L, -1, place, names_of_field(spec));
  lua_pop(L, 2);
  return spec;
}

// A number in m, or a text as --error takes it; on top of the stack.
AllowedError SceneReader::allowed_error(lua_State* L, const SourceLocation& place) const {
  if (lua_type(L, -1) == LUA_TNUMBER) {
    if (const double value = read_number(L, -1, place, "error"); value > 0) return {value, true};
  } else {
    const std::string text = read_text(L, -1, place, "error");
    try {
      const study::Budget budget = study::parse_budget("error", text);
      return {budget.value, budget.in_metres};
    } catch (const Error&) {  // said below, with its place
    }
  }
  scene_error(place, "bad error", "expected a share or an amount above 0, got " + show(L, -1),
              "write error = \"1%\", \"1 mm\" or 1e-3, in m");
}

// A number of J, or { energy = .., after = .. }; on top of the stack.
SleepSpec SceneReader::sleep(lua_State* L, const SourceLocation& place) const {
  SleepSpec spec;
  const auto positive = [&](const std::string& what) {
    const double value = read_number(L, -1, place, what);
    if (!(value > 0))
      scene_error(place, "bad " + what, "expected a number > 0, got " + show(L, -1),
                  "write sleep = 1e-6, in J, or sleep = { energy = 1e-6, after = 0.5 }");
    return value;
  };
  if (lua_type(L, -1) != LUA_TTABLE) {
    spec.energy = positive("sleep");
    return spec;
  }
  const int table = lua_absindex(L, -1);
  read_keys(L, table, {"energy", "after"}, place, "sleep");
  push_field(L, table, "energy");
  spec.energy = positive("energy of sleep");
  if (push_field(L, table, "after") != LUA_TNIL) spec.after = positive("after of sleep");
  lua_pop(L, 2);
  return spec;
}

// A name, or a sim.integrator.NAME{...}; on top of the stack.
void SceneReader::integrator(lua_State* L, SystemSpec& spec) const {
  const int value = lua_absindex(L, -1);
  const std::string kind = session_->push_record(L, value);
  if (kind == "integrator") {
    const int record = lua_absindex(L, -1);
    push_field(L, record, "plugin");
    const SourceLocation place = place_of(L, record);
    const IntegratorPlugin& plugin = registry_.get<Integrator>(lua_tostring(L, -1), place);
    PartSpec chosen = part(L, record, plugin, 1, nullptr);
    // Here, for a run may take another integrator and never look at these.
    Params(plugin.title(), plugin.params, chosen.given, place);
    spec.integrator = {chosen.plugin, std::move(chosen.given)};
  } else if (!kind.empty()) {
    scene_error(spec.place, "bad integrator", "expected a name, got a sim." + kind,
                "write integrator = \"rk4\"");
  } else {
    spec.integrator.name = read_text(L, value, spec.place, "integrator");
    registry_.get<Integrator>(one_line_text(spec.integrator.name), spec.place);
  }
  lua_settop(L, value);
}

// Calls visit(part, record) for each sim.KIND of the list `kind`s on top of the stack.
template <class Visit>
void SceneReader::each_part(lua_State* L, const std::string& kind, const SourceLocation& place,
                            Visit visit) const {
  const std::string name = kind + "s", form = "sim." + kind + ".NAME { ... }";
  const int list = lua_absindex(L, -1);
  if (const std::string got = session_->push_record(L, list); !got.empty())
    scene_error(place, "bad " + name, "expected a list, got a sim." + got,
                "write " + name + " = { " + form + " }");
  lua_pop(L, 1);
  const std::size_t count = read_length(L, list, place, name);
  for (std::size_t i = 0; i < count; ++i) {
    lua_rawgeti(L, list, static_cast<lua_Integer>(i) + 1);
    const int part = lua_absindex(L, -1);
    if (const std::string got = session_->push_record(L, part); got != kind)
      scene_error(place, "bad entry " + std::to_string(i + 1) + " of " + name,
                  "expected a " + form + ", got " + shown_part(L, part, got));
    visit(part, lua_absindex(L, -1));
    lua_settop(L, list);
  }
}

void SceneReader::second_order(lua_State* L, int scene, SystemSpec& spec) const {
  const SourceLocation& place = spec.place;
  const bool has_bodies = push_field(L, scene, "bodies") != LUA_TNIL;  // they need no others
  lua_pop(L, 1);
  const int type = push_field(L, scene, "particles");
  if (!has_bodies)
    require_key(type, place, "particles", "particles = sim.particles { ... } or sim.grid { ... }");
  const int handle = lua_absindex(L, -1);
  if (type != LUA_TNIL) {
    const std::string kind = session_->push_record(L, handle);
    if (kind != "particles")
      scene_error(place, "bad particles",
                  "expected a sim.particles or sim.grid, got " + shown_part(L, handle, kind),
                  kind == "added_grid" ? "give the particles that it was added to" : "");
    spec.particles = particles(L, lua_absindex(L, -1), place_of(L, -1));
  }
  const std::map<const void*, int> bodies = rigid_bodies(L, scene, spec);
  Body body{*spec.particles, handle, bodies, spec.bodies, spec.points};

  require_key(push_field(L, scene, "forces"), place, "forces",
              "forces = { ... }, or forces = {} for none");
  std::vector<const void*> handles;
  each_part(L, "force", place, [&](int force, int record) {
    handles.push_back(lua_topointer(L, force));
    lua_pushboolean(L, 1);
    lua_setfield(L, record, "used");
    push_field(L, record, "plugin");
    const ForcePlugin& plugin = registry_.get<Force>(lua_tostring(L, -1), place_of(L, record));
    PartSpec part_spec = part(L, record, plugin, 1, &body);
    part_spec.elements = elements(L, record, plugin, body, part_spec.place);
    if (plugin.pointwise) part_spec.particles = group(L, record, body, part_spec.place);
    spec.forces.push_back(std::move(part_spec));
  });
  weigh(L, handle, spec);
  check_numbers(L, handle, spec);
  constraints(L, scene, body, spec);
  spec.surfaces = surfaces(L, scene, body, spec);
  contact(L, scene, body, spec);
  lua_settop(L, handle - 1);
  const std::vector<const void*> solids = colliders(L, scene, spec);
  std::map<const void*, PartSpec*> parts;
  for (std::size_t i = 0; i < handles.size(); ++i) parts[handles[i]] = &spec.forces[i];
  for (std::size_t i = 0; i < solids.size(); ++i) parts[solids[i]] = &spec.colliders[i];
  switches(L, scene, parts, spec);
}

void SceneReader::switches(lua_State* L, int scene, const std::map<const void*, PartSpec*>& parts,
                           SystemSpec& spec) const {
  if (push_field(L, scene, "switches") != LUA_TNIL) {
    const int table = lua_absindex(L, -1);
    if (!lua_istable(L, table))
      scene_error(spec.place, "bad switches",
                  "expected { NAME = a force or collider, ... }, got " + show(L, table));
    for (lua_pushnil(L); lua_next(L, table); lua_pop(L, 1)) {
      const bool text = lua_type(L, -2) == LUA_TSTRING;
      const std::string name =
          text ? std::string(lua_tostring(L, -2), lua_rawlen(L, -2)) : std::string();
      if (!plain_word(name, "_-"))
        scene_error(spec.place, "bad name of a switch",
                    "expected letters, digits, _ and -, got " + show(L, -2));
      const auto part = parts.find(lua_topointer(L, -1));
      if (!lua_istable(L, -1) || part == parts.end())
        scene_error(spec.place, "bad switch '" + name + "'",
                    "expected one of the scene's forces or colliders, got " + show(L, -1));
      if (!part->second->switch_name.empty())
        scene_error(spec.place, "bad switch '" + name + "'",
                    "its part has the switch '" + part->second->switch_name + "' already");
      part->second->switch_name = name;
    }
  }
  lua_pop(L, 1);

  // Parts that are off and cannot be switched on are left out.
  for (std::vector<PartSpec>* list : {&spec.forces, &spec.colliders})
    std::erase_if(*list, [](const PartSpec& part) { return !part.on && part.switch_name.empty(); });
}

std::vector<const void*> SceneReader::colliders(lua_State* L, int scene, SystemSpec& spec) const {
  std::vector<const void*> handles;
  if (push_field(L, scene, "colliders") == LUA_TNIL) {
    lua_pop(L, 1);
    return handles;
  }
  each_part(L, "collider", spec.place, [&](int collider, int record) {
    handles.push_back(lua_topointer(L, collider));
    push_field(L, record, "plugin");
    spec.colliders.push_back(part(
        L, record, registry_.get<Collider>(lua_tostring(L, -1), place_of(L, record)), 1, nullptr));
  });
  lua_pop(L, 1);
  if (push_field(L, scene, "accuracy") != LUA_TNIL) {
    const std::string word = read_text(L, -1, spec.place, "accuracy");
    if (word != "settle" && word != "project" && word != "event")
      scene_error(spec.place, "bad accuracy",
                  "expected \"settle\", \"project\" or \"event\", got " + show(L, -1));
    spec.accuracy = word == "project" ? Accuracy::kProject
                    : word == "event" ? Accuracy::kEvent
                                      : Accuracy::kSettle;
  }
  lua_pop(L, 1);
  return handles;
}

void SceneReader::constraints(lua_State* L, int scene, Body& body, SystemSpec& spec) const {
  if (push_field(L, scene, "constraints") == LUA_TNIL) {
    lua_pop(L, 1);
    return;
  }
  each_part(L, "constraint", spec.place, [&](int /*constraint*/, int record) {
    lua_pushboolean(L, 1);
    lua_setfield(L, record, "used");
    push_field(L, record, "plugin");
    const auto& plugin = registry_.get<Constraint>(lua_tostring(L, -1), place_of(L, record));
    PartSpec part_spec = part(L, record, plugin, 1, &body);
    part_spec.elements = elements(L, record, plugin, body, part_spec.place);
    spec.constraints.push_back(std::move(part_spec));
  });
  lua_pop(L, 1);
}

void SceneReader::first_order(lua_State* L, int scene, SystemSpec& spec) const {
  const SourceLocation& place = spec.place;
  FirstOrderSpec& first = spec.first_order.emplace();
  require_key(push_field(L, scene, "state"), place, "state",
              "state = { x = {{1, 0, 0}} } or state = {1, 0}");
  const int state = lua_absindex(L, -1);
  if (const std::string got = session_->push_record(L, state); !got.empty())
    scene_error(place, "bad state", "expected points or numbers, got a sim." + got,
                "write state = { x = {{1, 0, 0}} } or state = {1, 0}");
  lua_pop(L, 1);
  read_state(L, state, place, first);

  require_key(push_field(L, scene, "field"), place, "field", "field = sim.field.NAME { ... }");
  const int field = lua_absindex(L, -1);
  if (const std::string got = session_->push_record(L, field); got != "field")
    scene_error(place, "bad field",
                "expected a sim.field.NAME { ... }, got " + shown_part(L, field, got));
  const int record = lua_absindex(L, -1);
  push_field(L, record, "plugin");
  const FieldPlugin& plugin = registry_.get<Field>(lua_tostring(L, -1), place_of(L, record));
  first.field = part(L, record, plugin, first.dimension, nullptr);
  lua_settop(L, state - 1);
}

}  // namespace sim
