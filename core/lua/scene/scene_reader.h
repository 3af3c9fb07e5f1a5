// The tables that a scene file returns, checked and turned into SceneSpec.
#pragma once

#include <memory>

#include "core/lua/scene/session.h"

namespace sim {

class SceneReader {
 public:
  SceneReader(std::shared_ptr<SceneSession> session, Registry& registry)
      : session_(std::move(session)), registry_(registry) {}

  // Inside protect(): reads the value on top of the stack. Throws Error{kScene}.
  SceneSpec read(lua_State* L) const;

 private:
  std::vector<SystemSpec> world(lua_State* L, int scenes, const Place& place) const;
  SystemSpec system(lua_State* L, int scene, const Place& place) const;
  void integrator(lua_State* L, SystemSpec& spec) const;
  void second_order(lua_State* L, int scene, SystemSpec& spec) const;
  void colliders(lua_State* L, int scene, SystemSpec& spec) const;
  void first_order(lua_State* L, int scene, SystemSpec& spec) const;
  ParticlesSpec particles(lua_State* L, int record, const Place& place) const;
  PartSpec part(lua_State* L, int record, const PluginInfo& plugin, int dimension) const;
  Links links(lua_State* L, int record, const ParticlesSpec& particles, int handle,
              const PartSpec& part) const;
  void grid_links(lua_State* L, int given, const GridSpec& grid, const Place& place,
                  std::vector<GridLinks>& out) const;
  Place place_of(lua_State* L, int record) const;

  std::shared_ptr<SceneSession> session_;
  Registry& registry_;
};

}  // namespace sim
