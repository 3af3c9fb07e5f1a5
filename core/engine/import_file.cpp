#include "core/engine/import_file.h"

#include <cctype>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/engine/import_h5md.h"
#include "core/engine/mesh_file.h"
#include "core/output/writer.h"

namespace sim::engine {
namespace {

// Two triangles at an edge have a corner each that is not on it: "across" ties these two.
constexpr const char* kMeshScene = R"lua(
local mass = sim.arg("mass", 0.3, "kg, of all")
local edge = sim.arg("edge", 500, "N/m, of springs along edges")
local across = sim.arg("across", 100, "N/m, of springs across edges, against bending")
local drag = sim.arg("drag", 0.5, "1/s, of the velocity")
local m = mass / #points

local body = sim.particles { mass = m }
local highest = 1
for i, x in ipairs(points) do
  body:add(x)
  if x[2] > points[highest][2] then highest = i end
end
body:pin(highest - 1)

-- Each edge once, with the corners that its triangles have besides it.
local edges, corners = {}, {}
for _, t in ipairs(triangles) do
  for k = 1, 3 do
    local a, b, c = t[k], t[k % 3 + 1], t[(k + 1) % 3 + 1]
    if a > b then a, b = b, a end
    local key = a * #points + b
    if not corners[key] then
      corners[key] = {}
      edges[#edges + 1] = { a, b, key }
    end
    table.insert(corners[key], c)
  end
end

local along = sim.force.spring { family = "edge", stiffness = edge }
local over = sim.force.spring { family = "across", stiffness = across }
local degree, most, tied = {}, 0, 0
local function tie(spring, k, a, b)
  spring:tie(a, b)
  for _, i in ipairs { a, b } do
    degree[i] = (degree[i] or 0) + k
    most = math.max(most, degree[i])
  end
end
for _, e in ipairs(edges) do
  tie(along, edge, e[1], e[2])
  local c = corners[e[3]]
  if #c == 2 and c[1] ~= c[2] then tie(over, across, c[1], c[2]); tied = tied + 1 end
end
local forces = { sim.force.gravity { g = {0, -9.81, 0} }, sim.force.drag { k = drag * m }, along }
if tied > 0 then forces[#forces + 1] = over end

return sim.scene {
  name = NAME, particles = body, forces = forces,
  surfaces = { sim.surface { particles = body, triangles = triangles } },
  integrator = "verlet", dt = 0.5 * math.sqrt(2 * m / most),  -- half of the limit at most
  duration = 2,
}
)lua";

std::string plain_name(const std::string& file) {
  std::string name = std::filesystem::path(file).stem().string();
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '-') c = '_';
  return name.empty() ? "mesh" : name.substr(0, 60);
}

}  // namespace

void import_file(const ImportTask& task) {
  if (is_hdf5(ending_of(task.file))) return import_h5md(task);
  constexpr std::size_t kBlock = std::size_t{1} << 20;
  const Mesh mesh = read_mesh(task.file);
  const std::string name = plain_name(task.file);
  std::string out = "-- " + name + ": " + std::to_string(mesh.points.size()) + " points, " +
                    std::to_string(mesh.triangles.size()) +
                    " triangles.\nlocal sim = require \"sim\"\nlocal points = {  -- m\n";
  const auto flush = [&](std::size_t least) {
    if (out.size() < least) return;
    task.write(out);
    out.clear();
  };
  for (const Vec3& p : mesh.points) {
    out += "{" + shortest(p.x()) + "," + shortest(p.y()) + "," + shortest(p.z()) + "},\n";
    flush(kBlock);
  }
  out += "}\nlocal triangles = {\n";
  for (const auto& [a, b, c] : mesh.triangles) {
    out += "{" + std::to_string(a) + "," + std::to_string(b) + "," + std::to_string(c) + "},\n";
    flush(kBlock);
  }
  std::string scene = kMeshScene;
  scene.replace(scene.find("NAME"), 4, "\"" + name + "\"");
  out += "}\n" + scene;
  flush(0);
  if (mesh.dropped > 0)
    task.tell("note: " + std::to_string(mesh.dropped) + " triangles without an area are left out");
}

}  // namespace sim::engine
