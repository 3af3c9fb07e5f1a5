#include "cli/verbs/new_scene.h"

#include "cli/run/environment.h"
#include "cli/verbs/new_folder.h"
#include "core/base/text.h"
#include "core/output/format.h"

namespace sim::cli {
namespace {

std::string scene_text(const std::string& name) {
  return R"(-- A net that hangs from two corners.
local sim = require "sim"
local n = sim.arg("n", 8, "particles along an edge")
local stiffness = sim.arg("stiffness", 100, "of the springs, N/m")

local s = 1 / n                                                            -- m, between neighbours
local net = sim.grid { n, n, du = {0, 0, s}, dv = {s, 0, 0}, mass = s * s }  -- kg, each
net:pin(net:id(0, 0), net:id(0, n - 1))

return sim.scene { name = ")" +
         name + R"(", particles = net,
  forces = {
    sim.force.gravity { g = {0, -9.81, 0} },                               -- m/s^2
    sim.force.drag { k = 2 * s * s },                                      -- kg/s
    sim.force.spring { stiffness = stiffness, grid = net, offsets = { {0, 1}, {1, 0} } },
  },
  integrator = "rk4", dt = 0.005, duration = 2 }                           -- s
)";
}

// Settings of Lua's language server: the version, the location of the types, and absent libraries.
std::string editor_settings() {
  return "{\n  \"runtime.version\": \"Lua 5.4\",\n  \"workspace.library\": [" +
         json_string(editor_types().parent_path().string()) +
         "],\n  \"runtime.builtin\": {\"io\": \"disable\", \"os\": \"disable\", \"debug\": "
         "\"disable\"}\n}\n";
}

}  // namespace

int new_scene(const NewSceneRequest& request, Console& console) {
  const std::string& name = request.name;
  if (!legal_folder_name(name))
    throw Error(ErrorKind::kUsage,
                {"bad name", "sim scene new '" + name + "'",
                 "a name has lower case letters, digits and _", "choose one like my_net"});
  NewFolder folder(name);
  folder.write(name + ".lua", scene_text(name));
  folder.write(".luarc.json", editor_settings());
  folder.keep();
  put(console.out, "wrote " + name + "/: " + name +
                       ".lua, .luarc.json\n\nrun, look, change:\n  sim " + name + "/" + name +
                       ".lua\n  sim view " + name + "/" + name +
                       ".lua\n  sim describe sim.scene\n");
  flush_or_throw(console.out, "standard output");
  return 0;
}

}  // namespace sim::cli
