#include "core/c/handles.h"

#include <cstdlib>
#include <cstring>

namespace sim::c {
namespace {

// Cut at a character where it does not fit.
template <std::size_t kRoom>
void fill(char (&room)[kRoom], const std::string& text) {
  std::size_t size = text.size();
  if (size >= kRoom) {
    size = kRoom - 1;
    while (size > 0 && (static_cast<unsigned char>(text[size]) & 0xC0) == 0x80) --size;
  }
  std::memcpy(room, text.data(), size);
  room[size] = '\0';
}

int tell(sim_error* error, int code, const ErrorText& text, const char* function) noexcept {
  if (error) {
    error->code = code;
    fill(error->what, text.what);
    fill(error->where, text.where.empty() ? function : text.where);
    fill(error->why, text.why);
    fill(error->remedy, text.remedy);
  }
  return code;
}

// Without memory for a text.
int tell_plainly(sim_error* error, const char* what, const char* function) noexcept {
  if (!error) return SIM_INTERNAL;
  error->code = SIM_INTERNAL;
  std::strncpy(error->what, what, sizeof error->what - 1);
  error->what[sizeof error->what - 1] = '\0';
  std::strncpy(error->where, function, sizeof error->where - 1);
  error->where[sizeof error->where - 1] = '\0';
  error->why[0] = error->remedy[0] = '\0';
  return SIM_INTERNAL;
}

}  // namespace

int tell(sim_error* error, const char* function) noexcept {
  try {
    throw;
  } catch (const Error& found) {
    const int code = static_cast<int>(found.kind());
    return tell(error, code, found.text(), function);
  } catch (const Stopped&) {
    tell_plainly(error, "stopped", function);
    if (error) error->code = SIM_STOPPED;
    return SIM_STOPPED;
  } catch (const std::bad_alloc&) {
    return tell_plainly(error, "out of memory", function);
  } catch (const std::exception& found) {
    return tell_plainly(error, found.what(), function);
  } catch (...) {
    return tell_plainly(error, "unknown exception", function);
  }
}

InCall::InCall(const sim_scene* scene) : scene_(scene) {
  checked(scene, "scene");
  auto free = sim_scene::State::kFree;
  if (!scene->state.compare_exchange_strong(free, sim_scene::State::kInCall,
                                            std::memory_order_acquire))
    refuse("busy handle", "scene", "it is in a call that has not ended",
           "use it when that is over; each thread has scenes of its own");
}

InCall::~InCall() {
  auto mine = sim_scene::State::kInCall;
  if (!scene_->state.compare_exchange_strong(mine, sim_scene::State::kFree,
                                             std::memory_order_release))
    delete scene_;
}

std::unique_ptr<sim_scene> opened(const std::string& name, const char* text, const Asked& asked,
                                  Watcher& watcher) {
  auto scene = std::make_unique<sim_scene>();
  scene->name = name;
  scene->from_file = !text;
  scene->asked = asked;
  scene->registry = registry_of(asked, environment_of(asked));
  const Stop::By question(*scene->stop, [&] { return watcher.stopped("scene", 0); });
  scene->loaded = stoppable_by(watcher, [&] {
    return load(name, text, asked, asked.variant, *scene->registry,
                [stop = scene->stop] { return stop->asked(); });
  });
  listen(*scene);
  return scene;
}

void listen(sim_scene& scene) {
  for (Simulation& system : scene.loaded.systems)
    system.stop_when([stop = scene.stop] { return stop->asked(); });
}

void close(sim_scene* scene) noexcept {
  if (!scene) return;
  // In a call, or free and then held for good: whoever ends the call frees it.
  for (auto now = scene->state.load();;) {
    if (now == sim_scene::State::kToBeClosed) return;
    const bool free = now == sim_scene::State::kFree;
    if (!scene->state.compare_exchange_weak(now, sim_scene::State::kToBeClosed)) continue;
    if (free) delete scene;
    return;
  }
}

char* given_away(const std::string& text) {
  char* const block = static_cast<char*>(std::malloc(text.size() + 1));
  if (!block) throw std::bad_alloc();
  std::memcpy(block, text.c_str(), text.size() + 1);
  return block;
}

const Simulation& system_of(const sim_scene* scene, int system) {
  const std::vector<Simulation>& systems = checked(scene, "scene").loaded.systems;
  if (system < 0 || static_cast<std::size_t>(system) >= systems.size())
    refuse("no such system", std::to_string(system),
           "the scene has " + std::to_string(systems.size()), "they count from 0");
  return systems[static_cast<std::size_t>(system)];
}

Simulation& system_of(sim_scene* scene, int system) {
  return const_cast<Simulation&>(system_of(const_cast<const sim_scene*>(scene), system));
}

}  // namespace sim::c
