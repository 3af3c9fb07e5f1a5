// A scene file: loaded with a small budget, compiled, and stepped a little.
#include <fstream>

#include "core/lua/scene/scene_file.h"
#include "core/scene/simulation.h"
#include "tests/fuzz/fuzz.h"

void sim_fuzz::fuzz(std::string_view bytes) {
  std::ofstream("a.lua", std::ios::binary) << bytes;
  const sim::SceneSpec scene = sim::load_scene(
      "a.lua", registry(),
      {.search_path = environment().scene_folders,
       .settings = {},
       .limits = {.seconds = 5, .memory = std::size_t{64} << 20, .steps = 2'000'000},
       .safe = true});
  for (const sim::SystemSpec& spec : scene.systems) {
    constexpr int kMostParticles = 2000;  // larger ones are only slower
    if (spec.particles && spec.particles->count() > kMostParticles) continue;
    sim::Simulation system(spec, registry());
    for (int step = 0; step < 2 && system.step(); ++step) spec.observe(system);
  }
}
