#include "core/lua/scene/look_reader.h"

#include "core/base/text.h"
#include "core/lua/lua_read.h"
#include "core/lua/scene/session.h"
#include "core/picture/look.h"

namespace sim {
namespace {

// "eye=1,0.5,2"
std::string point_text(const std::string& name, const Vec3& p) {
  return name + '=' + shortest(p.x()) + ',' + shortest(p.y()) + ',' + shortest(p.z());
}

void add_springs(lua_State* L, int value, const SourceLocation& place, LookSpec& look) {
  if (lua_isinteger(L, value))
    look.springs.push_back(std::to_string(lua_tointeger(L, value)));
  else
    look.springs.push_back(read_text(L, value, place, "springs of look"));
}

}  // namespace

LookSpec read_look(lua_State* L, int index, const SourceLocation& place,
                   const std::vector<std::string>& names) {
  index = lua_absindex(L, index);
  if (!lua_istable(L, index))
    scene_error(place, "bad look", "expected { color = \"strain\", .. }, got " + show(L, index));
  read_keys(L, index, {"eye", "at", "up", "fov", "color", "springs", "wireframe", "size"}, place,
            "look");
  LookSpec look;
  const int top = lua_gettop(L);
  std::vector<std::string> camera;
  for (const char* name : {"eye", "at", "up"})
    if (push_field(L, index, name) != LUA_TNIL)
      camera.push_back(point_text(name, read_vector(L, -1, place, name + std::string(" of look"))));
  if (push_field(L, index, "fov") != LUA_TNIL)
    camera.push_back("fov=" + shortest(read_number(L, -1, place, "fov of look")));
  look.camera = join(camera, " ");
  for (const auto& [name, text] : {std::pair{"color", &look.color}, {"size", &look.size}})
    if (push_field(L, index, name) != LUA_TNIL)
      *text = read_text(L, -1, place, name + std::string(" of look"));
  if (const int type = push_field(L, index, "springs"); type == LUA_TTABLE) {
    const int list = lua_absindex(L, -1);
    const std::size_t count = read_length(L, list, place, "springs of look");
    for (std::size_t i = 0; i < count && i < 1000; ++i) {
      lua_rawgeti(L, list, static_cast<lua_Integer>(i) + 1);
      add_springs(L, -1, place, look);
      lua_pop(L, 1);
    }
  } else if (type != LUA_TNIL) {
    add_springs(L, lua_gettop(L), place, look);
  }
  if (const int type = push_field(L, index, "wireframe"); type == LUA_TBOOLEAN)
    look.wireframe = lua_toboolean(L, -1) == 1;
  else if (type != LUA_TNIL)
    scene_error(place, "bad wireframe of look", "expected true or false, got " + show(L, -1));
  lua_settop(L, top);
  try {
    make_look(look, {}, names);
  } catch (const Error& error) {
    scene_error(place, "bad look", error.text().why, error.text().remedy);
  }
  return look;
}

}  // namespace sim
