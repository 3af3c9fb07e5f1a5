#include "tests/bench/peer_scene.h"

#include <algorithm>
#include <fstream>
#include <vector>

#include "core/base/error.h"
#include "core/base/text.h"
#include "tests/bench/cloth.h"

namespace sim_bench {
namespace {

// The value that the scene gives to the first force of that name; null if it gives none.
const sim::Value* find_value(const sim::SystemSpec& spec, const std::string& plugin,
                             const std::string& name) {
  for (const sim::PartSpec& part : spec.forces)
    if (part.plugin == plugin && part.given.contains(name)) return &part.given.at(name);
  return nullptr;
}

void add_row(std::string& out, const std::vector<double>& numbers) {
  for (const double number : numbers) {
    sim::append_number(out, number);
    out += ' ';
  }
  out.back() = '\n';
}

const sim::PartSpec* find_collider(const sim::SystemSpec& spec, const std::string& plugin) {
  const auto found = std::ranges::find(spec.colliders, plugin, &sim::PartSpec::plugin);
  return found == spec.colliders.end() ? nullptr : &*found;
}

// Center, radius, no cube, friction, thickness, ground; zeros for what is not there.
std::vector<double> numbers_of_solids(const sim::SystemSpec& spec) {
  std::vector<double> numbers(8);
  if (const sim::PartSpec* const sphere = find_collider(spec, "sphere")) {
    const auto center = std::get<sim::Vec3>(sphere->given.at("center"));
    for (int axis = 0; axis < 3; ++axis) numbers[static_cast<std::size_t>(axis)] = center[axis];
    numbers[3] = number_of(sphere->given.at("radius"));
    numbers[5] = number_of(sphere->given.at("friction"));
  }
  if (spec.contact) numbers[6] = number_of(spec.contact->given.at("thickness"));
  if (const sim::PartSpec* const plane = find_collider(spec, "plane"))
    numbers[7] = std::get<sim::Vec3>(plane->given.at("point"))[1];
  return numbers;
}

void put(const std::filesystem::path& path, const std::string& text) {
  std::ofstream out(path, std::ios::binary);
  out << text;
  out.close();
  if (!out)
    throw sim::Error(sim::ErrorKind::kIo, {"cannot write the scene", path.string(), "", ""});
}

}  // namespace

std::vector<std::array<int, 3>> triangles_in_contact(const sim::SystemSpec& spec) {
  std::vector<std::array<int, 3>> triangles;
  if (!spec.contact) return triangles;
  for (const auto& surface : spec.contact->surfaces)
    triangles.insert(triangles.end(), surface->triangles().begin(), surface->triangles().end());
  return triangles;
}

void write_cubes(const std::filesystem::path& path, const Cubes& cubes) {
  std::string text;
  add_row(text, {static_cast<double>(cubes.centers.size()), 0, 0, 0});
  add_row(text, {0, -9.81, 0, 0, cubes.h});
  add_row(text, {0, 0, 0, 0});
  add_row(text, {0, 0, 0, 0, cubes.half, cubes.friction, 0, 0});
  for (const sim::Vec3& x : cubes.centers) add_row(text, {x[0], x[1], x[2], 0, 0, 0, cubes.mass});
  put(path, text);
}

void write_scene(const std::filesystem::path& path, const sim::SystemSpec& spec,
                 const sim::Simulation& simulation) {
  const int n = simulation.particles();
  std::string springs;
  long count = 0;
  for (int i = 0; i < n; ++i)
    for (const sim::Link& link : simulation.links(i)) {
      if (link.to < i) continue;
      add_row(springs, {1.0 * i, 1.0 * link.to, link.stiffness, link.rest});
      ++count;
    }

  const std::vector<std::array<int, 3>> triangles = triangles_in_contact(spec);
  const std::vector<int>& pinned = spec.particles->pinned;
  const sim::Value* const gravity = find_value(spec, "gravity", "g");
  const sim::Vec3 g = gravity ? std::get<sim::Vec3>(*gravity) : sim::Vec3::Zero();
  const sim::Value* const drag = find_value(spec, "drag", "k");
  std::string head;
  add_row(head, {1.0 * n, static_cast<double>(count), static_cast<double>(pinned.size()),
                 static_cast<double>(triangles.size())});
  add_row(head, {g[0], g[1], g[2], drag ? number_of(*drag) : 0, simulation.h()});
  const auto of_pair = [&](const char* name) {
    const sim::Value* const value = find_value(spec, "pair", name);
    return value ? number_of(*value) : 0;
  };
  add_row(head, {of_pair("epsilon"), of_pair("sigma"), of_pair("cutoff"), of_pair("skin")});
  add_row(head, numbers_of_solids(spec));
  for (int i = 0; i < n; ++i) {
    const sim::ParticleSpec p = spec.particles->at(i);
    add_row(head, {p.position[0], p.position[1], p.position[2], p.velocity[0], p.velocity[1],
                   p.velocity[2], p.mass});
  }
  std::string pins;
  for (const int id : pinned) add_row(pins, {1.0 * id});

  std::string faces;
  for (const auto& [a, b, c] : triangles) add_row(faces, {1.0 * a, 1.0 * b, 1.0 * c});

  put(path, head + springs + pins + faces);
}

}  // namespace sim_bench
