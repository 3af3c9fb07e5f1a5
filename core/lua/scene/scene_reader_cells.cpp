// Cells of bodies, and the masses that they give to particles.
#include <limits>

#include "core/base/memory.h"
#include "core/geometry/cells.h"
#include "core/lua/lua_read.h"
#include "core/lua/lua_table.h"
#include "core/lua/scene/scene_reader.h"

namespace sim {

// The key `cells` of a force; false if it has none.
bool SceneReader::cells(lua_State* L, int index, const Body& body, const SourceLocation& place,
                        Elements& out) const {
  const LuaTable record(L, index), given = record.table("given");
  if (push_field(L, given.index(), "cells") == LUA_TNIL) return false;
  const int handle = lua_gettop(L);
  if (session_->push_record(L, handle) != "cells")
    scene_error(place, "bad cells", "expected a sim.cells { ... }, got " + show(L, handle));
  const LuaTable cells(L, -1);
  const SourceLocation written = place_of(L, cells.index());
  push_field(L, cells.index(), "on");
  const int on = lua_gettop(L);

  if (cells.flag("grid")) {
    const GridSpec& grid = this->grid(L, on, body, written);
    const auto order = static_cast<int>(cells.integer("order"));
    out.arity = order == 1 ? 4 : 10;
    double ids = 6.0 * out.arity;
    for (const int size : grid.size) ids *= (size - 1) / order;
    if (ids > std::numeric_limits<int>::max())
      scene_error(written, "too many cells", "their ids are more than 2^31 - 1",
                  "make the grid smaller");
    session_->count(0, ids / out.arity, written);
    require_memory(sizeof(int) * ids, "the ids of its cells need", written,
                   "make the grid smaller");
    out.ids = grid_cells(grid.size, order);
    for (int& id : out.ids) id += grid.first;
    return true;
  }
  require_own(L, on, body, written, "cells");
  out.arity = static_cast<int>(cells.integer("arity"));
  const LuaTable ids = cells.table("ids");
  for (lua_Integer i = 1; i <= ids.length(); ++i) {
    const lua_Integer id = ids.integer(i), tetrahedron = (i - 1) / out.arity + 1;
    if (id >= body.particles.count())
      scene_error(written, "bad tetrahedron " + std::to_string(tetrahedron),
                  "there is no particle " + std::to_string(id),
                  "the ids of the scene are 0 to " + std::to_string(body.particles.count() - 1));
    out.ids.push_back(static_cast<int>(id));
  }
  return true;
}

// A particle has its mass from the cells at it or from the scene, not from both.
void SceneReader::weigh(lua_State* L, int particles, SystemSpec& spec) const {
  weigh_cells(spec);
  const std::vector<double>& weights = spec.particles->weights;
  if (weights.empty()) return;
  session_->push_record(L, particles);
  const LuaTable record(L, -1);
  const LuaTable masses = record.table("masses");
  const bool weighed = record.flag("weighed");
  const auto listed = static_cast<lua_Integer>(weights.size() - spec.particles->list.size());
  for (const PartSpec& part : spec.forces) {
    if (!part.elements.cells || !part.given.count("density")) continue;
    for (const int id : part.elements.ids) {
      if (!(weights[static_cast<std::size_t>(id)] > 0))
        scene_error(part.place, "bad density",
                    "it leaves particle " + std::to_string(id) + " without a mass",
                    "give a density > 0 kg/m^3");
      const bool own = id >= listed && masses.number(id - listed + 1, 0) > 0;
      if (weighed || own)
        scene_error(part.place, "density and mass",
                    "particle " + std::to_string(id) +
                        " is given a mass of its own, and another "
                        "one by the density of its cells",
                    "leave out the mass of the particles, or the density");
    }
  }
}

}  // namespace sim
