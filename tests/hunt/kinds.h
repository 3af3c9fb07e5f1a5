// Scenes at random of every kind of physics, as Lua files say them.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace sim_test {

struct HuntKind {
  const char* name;
  std::string (*scene)(std::uint64_t seed);  // the text; it names a step that is right
};

std::span<const HuntKind> hunt_kinds();

}  // namespace sim_test
