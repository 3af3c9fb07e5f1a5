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

int tell(sim_error* error, int code, const ErrorText& text) noexcept {
  if (error) {
    error->code = code;
    fill(error->what, text.what);
    fill(error->where, text.where);
    fill(error->why, text.why);
    fill(error->remedy, text.remedy);
  }
  return code;
}

// Without memory for a text.
int tell_plainly(sim_error* error, const char* what) noexcept {
  if (!error) return SIM_INTERNAL;
  error->code = SIM_INTERNAL;
  std::strncpy(error->what, what, sizeof error->what - 1);
  error->what[sizeof error->what - 1] = '\0';
  error->where[0] = error->why[0] = error->remedy[0] = '\0';
  return SIM_INTERNAL;
}

}  // namespace

int tell(sim_error* error) noexcept {
  try {
    throw;
  } catch (const Error& found) {
    const int code = static_cast<int>(found.kind());
    return tell(error, code, found.text());
  } catch (const Stopped&) {
    tell_plainly(error, "stopped");
    if (error) error->code = SIM_STOPPED;
    return SIM_STOPPED;
  } catch (const std::bad_alloc&) {
    return tell_plainly(error, "out of memory");
  } catch (const std::exception& found) {
    return tell_plainly(error, found.what());
  } catch (...) {
    return tell_plainly(error, "unknown exception");
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
