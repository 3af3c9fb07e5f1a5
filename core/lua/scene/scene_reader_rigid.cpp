// Rigid bodies and their points, read from the records of the scene language.
#include "core/lua/lua_read.h"
#include "core/lua/lua_table.h"
#include "core/lua/scene/scene_reader.h"

namespace sim {
namespace {

RigidShape read_shape(lua_State* L, int index, SceneSession& session) {
  const LuaTable record(L, index);
  push_field(L, index, "form");
  const std::string form = lua_tostring(L, -1);
  RigidShape shape;
  shape.radius = record.number("radius");
  shape.length = record.number("length");
  if (form == "box") {
    shape.form = RigidShape::Form::kBox;
    shape.half = record.vector("half");
  } else if (form == "capsule") {
    shape.form = RigidShape::Form::kCapsule;
  } else if (form == "mesh") {
    shape.form = RigidShape::Form::kMesh;
    const LuaTable points = record.table("points"), triangles = record.table("triangles");
    for (lua_Integer i = 1; i + 2 <= points.length(); i += 3)
      shape.points.push_back({points.number(i), points.number(i + 1), points.number(i + 2)});
    for (lua_Integer i = 1; i + 2 <= triangles.length(); i += 3)
      shape.triangles.push_back({static_cast<int>(triangles.integer(i)),
                                 static_cast<int>(triangles.integer(i + 1)),
                                 static_cast<int>(triangles.integer(i + 2))});
  } else if (form == "compound") {
    std::vector<RigidShape> parts;
    const LuaTable list = record.table("parts");
    for (lua_Integer i = 1; i <= list.length(); ++i) {
      const StackScope scope(L);
      lua_rawgeti(L, list.index(), i);
      const LuaTable part(L, lua_gettop(L));
      push_field(L, part.index(), "shape");
      session.push_record(L, lua_gettop(L));
      RigidShape& added = parts.emplace_back(read_shape(L, lua_gettop(L), session));
      added.at = part.vector("at");
      added.rotation = part.vector("rotation");
    }
    return make_compound(std::move(parts));
  }
  return shape;
}

}  // namespace

// The key `bodies` of a scene; their particles are behind its own.
std::map<const void*, int> SceneReader::rigid_bodies(lua_State* L, int scene,
                                                     SystemSpec& spec) const {
  std::map<const void*, int> known;
  std::map<const void*, std::shared_ptr<const RigidShape>> shapes;  // bodies share them
  const int top = lua_gettop(L);
  if (push_field(L, scene, "bodies") != LUA_TNIL) {
    const int list = lua_gettop(L);
    const std::size_t count = read_length(L, list, spec.place, "bodies");
    if (count == 0) scene_error(spec.place, "bad bodies", "the list is empty", "leave it out");
    for (std::size_t i = 1; i <= count; ++i) {
      const StackScope scope(L);
      const std::string what = "entry " + std::to_string(i) + " of bodies";
      lua_rawgeti(L, list, static_cast<lua_Integer>(i));
      const int handle = lua_gettop(L);
      if (session_->push_record(L, handle) != "rigid")
        scene_error(spec.place, "bad " + what,
                    "expected a sim.rigid { ... }, got " + show(L, handle));
      if (!known.emplace(lua_topointer(L, handle), static_cast<int>(i) - 1).second)
        scene_error(spec.place, "bad " + what, "the body is in the list already");
      const int index = lua_gettop(L);
      const LuaTable record(L, index);
      RigidSpec& body = spec.bodies.emplace_back();
      body.place = place_of(L, index);
      push_field(L, index, "shape");
      std::shared_ptr<const RigidShape>& shape = shapes[lua_topointer(L, -1)];
      session_->push_record(L, lua_gettop(L));
      if (!shape)
        shape = std::make_shared<const RigidShape>(read_shape(L, lua_gettop(L), *session_));
      body.mass = record.number("mass");
      if (!(body.mass > 0))
        body.mass = record.number("density") *
                    of_scene(body.place, [&] { return mass_properties(*shape).volume; });
      body.shape = shape;
      body.position = record.vector("position");
      body.rotation = record.vector("rotation");
      body.velocity = record.vector("velocity");
      body.angular_velocity = record.vector("angular_velocity");
      body.touches = record.flag("touches");
      body.surface = {record.number("restitution"), record.number("friction")};
      if (push_field(L, index, "law") != LUA_TNIL) {
        session_->push_record(L, lua_gettop(L));
        body.surface = surface_of(law(L, lua_gettop(L)));
      }
    }
  }
  lua_settop(L, top);
  place_bodies(spec);
  return known;
}

std::shared_ptr<const RigidBody> SceneReader::known_body(lua_State* L, int handle, const Body* body,
                                                         const SourceLocation& place,
                                                         const std::string& what) const {
  if (!body) scene_error(place, "bad " + what, "only forces between particles know bodies");
  const auto known = body->bodies.find(lua_topointer(L, handle));
  if (known == body->bodies.end())
    scene_error(place, "bad " + what, "it is not in this scene", "put it into bodies = { ... }");
  const RigidSpec& spec = body->rigid[static_cast<std::size_t>(known->second)];
  return std::make_shared<const RigidBody>(spec.shape, spec.mass, spec.first);
}

// On top of the stack.
Bodies SceneReader::body_list(lua_State* L, const Body* body, const SourceLocation& place,
                              const std::string& what) const {
  Bodies bodies;
  const int list = lua_gettop(L);
  const std::size_t count = read_length(L, list, place, what);
  for (std::size_t i = 1; i <= count; ++i) {
    const std::string entry = "entry " + std::to_string(i) + " of " + what;
    lua_rawgeti(L, list, static_cast<lua_Integer>(i));
    if (session_->push_record(L, lua_gettop(L)) != "rigid")
      scene_error(place, "bad " + entry, "expected a sim.rigid { ... }, got " + show(L, list + 1));
    auto next = known_body(L, list + 1, body, place, entry);
    for (const auto& other : bodies)
      if (other->first() == next->first())
        scene_error(place, "bad " + entry, "the body is in the list already");
    bodies.push_back(std::move(next));
    lua_settop(L, list);
  }
  return bodies;
}

// The id that stands for a point of a body, on the stack.
int SceneReader::point(lua_State* L, int handle, const Body& body,
                       const SourceLocation& place) const {
  const int top = lua_gettop(L);
  if (session_->push_record(L, handle) != "point")
    scene_error(place, "bad tie",
                "expected a particle id or a body:at{...}, got " + show(L, handle));
  const int index = lua_gettop(L);
  push_field(L, index, "body");
  const auto known = body.bodies.find(lua_topointer(L, -1));
  if (known == body.bodies.end())
    scene_error(place, "bad point of a body", "its body is not in this scene",
                "put it into bodies = { ... }");
  const LuaTable record(L, index);
  body.points.push_back({known->second, record.vector("at")});
  lua_settop(L, top);
  return body.particles.count() + static_cast<int>(body.points.size()) - 1;
}

}  // namespace sim
