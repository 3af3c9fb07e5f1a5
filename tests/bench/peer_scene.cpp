#include "tests/bench/peer_scene.h"

#include <fstream>
#include <vector>

#include "core/base/error.h"
#include "core/base/text.h"
#include "tests/bench/cloth.h"

namespace sim_bench {
namespace {

// What the scene gives to the first force of that name; null when it gives nothing.
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

// Center, radius, no cube, friction; zeros without a sphere.
std::vector<double> numbers_of_sphere(const sim::SystemSpec& spec) {
  for (const sim::PartSpec& part : spec.colliders)
    if (part.plugin == "sphere") {
      const auto center = std::get<sim::Vec3>(part.given.at("center"));
      return {center[0], center[1],
              center[2], number_of(part.given.at("radius")),
              0,         number_of(part.given.at("friction"))};
    }
  return {0, 0, 0, 0, 0, 0};
}

void put(const std::filesystem::path& path, const std::string& text) {
  std::ofstream out(path, std::ios::binary);
  out << text;
  out.close();
  if (!out)
    throw sim::Error(sim::ErrorKind::kIo, {"cannot write the scene", path.string(), "", ""});
}

}  // namespace

void write_cubes(const std::filesystem::path& path, const Cubes& cubes) {
  std::string text;
  add_row(text, {1.0 * static_cast<double>(cubes.centers.size()), 0, 0});
  add_row(text, {0, -9.81, 0, 0, cubes.h});
  add_row(text, {0, 0, 0, 0});
  add_row(text, {0, 0, 0, 0, cubes.half, cubes.friction});
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

  const std::vector<int>& pinned = spec.particles->pinned;
  const sim::Value* const gravity = find_value(spec, "gravity", "g");
  const sim::Vec3 g = gravity ? std::get<sim::Vec3>(*gravity) : sim::Vec3::Zero();
  const sim::Value* const drag = find_value(spec, "drag", "k");
  std::string head;
  add_row(head,
          {1.0 * n, 1.0 * static_cast<double>(count), 1.0 * static_cast<double>(pinned.size())});
  add_row(head, {g[0], g[1], g[2], drag ? number_of(*drag) : 0, simulation.h()});
  const auto of_pair = [&](const char* name) {
    const sim::Value* const value = find_value(spec, "pair", name);
    return value ? number_of(*value) : 0;
  };
  add_row(head, {of_pair("epsilon"), of_pair("sigma"), of_pair("cutoff"), of_pair("skin")});
  add_row(head, numbers_of_sphere(spec));
  for (int i = 0; i < n; ++i) {
    const sim::ParticleSpec p = spec.particles->at(i);
    add_row(head, {p.position[0], p.position[1], p.position[2], p.velocity[0], p.velocity[1],
                   p.velocity[2], p.mass});
  }
  std::string pins;
  for (const int id : pinned) add_row(pins, {1.0 * id});

  put(path, head + springs + pins);
}

}  // namespace sim_bench
