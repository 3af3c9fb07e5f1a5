// A checkpoint: as it is, and with the checksum that makes its contents believed.
#include <algorithm>
#include <string>

#include "cli/run/scene.h"
#include "core/session/checkpoint.h"
#include "tests/fuzz/fuzz.h"

namespace {

void resume_from(std::string_view bytes) {
  const sim::Checkpoint saved = sim::decode(bytes, "a.snap");
  sim::cli::SceneRequest request;
  request.scene = "scenes/pendulum.lua";
  static const sim::SceneSpec scene = [&] {
    return sim::cli::load(request, sim_fuzz::environment(), sim_fuzz::registry()).spec;
  }();
  const sim::SystemSpec& spec = scene.systems.front();
  sim::Simulation system(spec, sim_fuzz::registry());
  for (const sim::Checkpoint::System& each : saved.systems) {
    sim::resume(system, spec, each, sim_fuzz::registry());
    system.step();
  }
}

}  // namespace

void sim_fuzz::fuzz(std::string_view bytes) {
  constexpr std::size_t kSeal = 8;
  if (bytes.size() < kSeal) return;
  const std::string sealed = sim::sealed(bytes.substr(0, bytes.size() - kSeal));
  try {
    resume_from(sealed);
  } catch (const sim::Error& error) {
    if (error.kind() == sim::ErrorKind::kInternal) throw;
  }
  resume_from(bytes);
}
