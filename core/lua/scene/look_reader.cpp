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

// An id or a text, or a list of these.
void read_choices(lua_State* L, int index, const char* name, const SourceLocation& place,
                  std::vector<std::string>& out) {
  const std::string what = name + std::string(" of look");
  const auto add = [&](int value) {
    out.push_back(lua_isinteger(L, value) ? std::to_string(lua_tointeger(L, value))
                                          : read_text(L, value, place, what));
  };
  const int type = push_field(L, index, name);
  if (type == LUA_TNIL) return;
  if (type != LUA_TTABLE) return add(lua_gettop(L));
  const int list = lua_absindex(L, -1);
  const std::size_t count = read_length(L, list, place, what);
  for (std::size_t i = 0; i < count && i < 1000; ++i) {
    lua_rawgeti(L, list, static_cast<lua_Integer>(i) + 1);
    add(lua_gettop(L));
    lua_pop(L, 1);
  }
}

}  // namespace

LookSpec read_look(lua_State* L, int index, const SourceLocation& place,
                   const std::vector<std::string>& names) {
  index = lua_absindex(L, index);
  if (!lua_istable(L, index))
    scene_error(place, "bad look", "expected { color = \"strain\", .. }, got " + show(L, index));
  read_keys(L, index,
            {"eye", "at", "up", "fov", "color", "springs", "trail", "wireframe", "surface", "size"},
            place, "look");
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
  read_choices(L, index, "springs", place, look.springs);
  read_choices(L, index, "trail", place, look.trails);
  for (const auto& [name, flag] :
       {std::pair{"wireframe", &look.wireframe}, {"surface", &look.surface}})
    if (const int type = push_field(L, index, name); type == LUA_TBOOLEAN)
      *flag = lua_toboolean(L, -1) == 1;
    else if (type != LUA_TNIL)
      scene_error(place, "bad " + std::string(name) + " of look",
                  "expected true or false, got " + show(L, -1));
  lua_settop(L, top);
  try {
    make_look(look, {}, names);
  } catch (const Error& error) {
    scene_error(place, "bad look", error.text().why, error.text().remedy);
  }
  return look;
}

}  // namespace sim
