// Guards calls of plugin code: exceptions become errors that name the plugin, and the rounding mode
// of this thread is restored.
#pragma once

#include <new>
#include <string>

#include "core/base/error.h"
#include "core/base/float_control.h"
#include "core/plugin/registry.h"

namespace sim {

// The current exception, as an error of `who` ("force 'spring' of spring.so") in `what` ("its
// constructor"). Errors, and exhausted memory, are passed on unchanged.
[[noreturn]] void rethrow_from_plugin(const std::string& who, const SourceLocation& place,
                                      const std::string& what);

template <class Object, class... Given>
std::unique_ptr<Object> made_by(const Plugin<Object>& plugin, const SourceLocation& place,
                                const Given&... given) {
  const FloatControl control;
  try {
    return made(plugin.make(given...), plugin);
  } catch (...) {
    rethrow_from_plugin(plugin.title() + " of " + plugin.file, place, "while it was made");
  }
}

}  // namespace sim
