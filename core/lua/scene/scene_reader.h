// The tables that a scene file returns, checked and turned into SceneSpec.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/lua/scene/session.h"

namespace sim {

class LuaTable;

class SceneReader {
 public:
  SceneReader(std::shared_ptr<SceneSession> session, Registry& registry)
      : session_(std::move(session)), registry_(registry) {}

  // Inside protect(): reads the value on top of the stack. Throws Error{kScene}.
  SceneSpec read(lua_State* L) const;

 private:
  std::vector<SystemSpec> world(lua_State* L, int scenes, const SourceLocation& place) const;
  SystemSpec system(lua_State* L, int scene, const SourceLocation& place) const;
  void integrator(lua_State* L, SystemSpec& spec) const;
  AllowedError allowed_error(lua_State* L, const SourceLocation& place) const;
  SleepSpec sleep(lua_State* L, const SourceLocation& place) const;
  template <class Visit>
  void each_part(lua_State* L, const std::string& kind, const SourceLocation& place,
                 Visit visit) const;
  void second_order(lua_State* L, int scene, SystemSpec& spec) const;
  std::vector<const void*> colliders(lua_State* L, int scene, SystemSpec& spec) const;
  struct Body;
  void constraints(lua_State* L, int scene, Body& body, SystemSpec& spec) const;
  std::map<const void*, int> rigid_bodies(lua_State* L, int scene, SystemSpec& spec) const;
  int point(lua_State* L, int handle, const Body& body, const SourceLocation& place) const;
  std::shared_ptr<const RigidBody> known_body(lua_State* L, int handle, const Body* body,
                                              const SourceLocation& place,
                                              const std::string& what) const;
  Bodies body_list(lua_State* L, const Body* body, const SourceLocation& place,
                   const std::string& what) const;
  // `parts`: by their handles.
  void switches(lua_State* L, int scene, const std::map<const void*, PartSpec*>& parts,
                SystemSpec& spec) const;
  void first_order(lua_State* L, int scene, SystemSpec& spec) const;
  ParticlesSpec particles(lua_State* L, int record, const SourceLocation& place) const;
  void prescribed(lua_State* L, const LuaTable& record, int count, ParticlesSpec& spec) const;

  // The objects that parts of a second-order scene may refer to.
  struct Body {
    const ParticlesSpec& particles;
    int handle;                                // of the particles, on the stack
    const std::map<const void*, int>& bodies;  // by their handles
    const std::vector<RigidSpec>& rigid;
    std::vector<BodyPoint>& points;
    std::map<const void*, std::shared_ptr<const TriangleMesh>> surfaces = {};  // read so far
  };
  PartSpec part(lua_State* L, int record, const PluginInfo& plugin, int dimension,
                Body* body) const;
  bool read_reference(lua_State* L, int value, Body* body, const SourceLocation& place,
                      Value& out) const;
  template <class Object>
  std::shared_ptr<const Object> made_once(lua_State* L, int record) const;
  std::shared_ptr<const RigidMotion> motion(lua_State* L, int record) const;
  std::shared_ptr<const ContactLaw> law(lua_State* L, int record) const;
  std::shared_ptr<const ColliderMaker> collider(lua_State* L, int record) const;
  Colliders collider_list(lua_State* L, const SourceLocation& place, const std::string& what) const;
  std::shared_ptr<const TriangleMesh> surface(lua_State* L, int handle, int record,
                                              Body& body) const;
  std::vector<std::shared_ptr<const TriangleMesh>> surfaces(lua_State* L, int scene, Body& body,
                                                            const SystemSpec& spec) const;
  void contact(lua_State* L, int scene, Body& body, SystemSpec& spec) const;
  Elements elements(lua_State* L, int record, const PluginInfo& plugin, const Body& body,
                    const SourceLocation& place) const;
  bool cells(lua_State* L, int record, const Body& body, const SourceLocation& place,
             Elements& out) const;
  void weigh(lua_State* L, int particles, SystemSpec& spec) const;
  void check_numbers(lua_State* L, int particles, const SystemSpec& spec) const;
  const GridSpec& grid(lua_State* L, int handle, const Body& body,
                       const SourceLocation& place) const;
  void grid_pairs(lua_State* L, int record, const Body& body, const SourceLocation& place,
                  std::vector<GridPairs>& out) const;
  void offset_pairs(lua_State* L, const GridSpec& grid, int offsets, const SourceLocation& place,
                    std::vector<GridPairs>& out) const;
  std::optional<std::vector<int>> group(lua_State* L, int record, const Body& body,
                                        const SourceLocation& place, bool points = false) const;
  void require_own(lua_State* L, int index, const Body& body, const SourceLocation& place,
                   const std::string& what) const;
  SourceLocation place_of(lua_State* L, int record) const;
  void check_ties(lua_State* L) const;

  std::shared_ptr<SceneSession> session_;
  Registry& registry_;
};

}  // namespace sim
