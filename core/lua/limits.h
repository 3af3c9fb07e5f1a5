// The resource limits of Lua, for code that may not include Lua.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "core/base/error.h"

namespace sim {

// For loading a scene and for each call of one of its functions, or for all of them in a run
// together; and for each line at a prompt.
struct LuaLimits {
  double seconds = 10;                        // of processor time
  std::size_t memory = std::size_t{1} << 30;  // bytes; at most half the machine's
  std::uint64_t steps = 0;  // instructions, or work in libraries that costs about as much; 0 = any
  bool seconds_in_all = false, steps_in_all = false;  // of the run, not of each call
};

// The limits of a stranger's scene.
inline LuaLimits safe_limits() {
  return {.memory = std::size_t{256} << 20, .seconds_in_all = true, .steps_in_all = true};
}

// The limits, changed by "time=60,memory=4096,steps=1e9" (s, MB), each if it is there; `name`: what
// errors call the text. Throws Error{kUsage}.
LuaLimits with_budget(LuaLimits limits, const std::string& name, const std::string& text);

// Told from another thread that Lua is beyond its budget and cannot be ended: who hears it ends the
// process.
using LuaOverrun = void (*)(const ErrorText& why);

}  // namespace sim
