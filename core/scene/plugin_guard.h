// Code of plugins, from where it is called: its exceptions become errors that name it, and how this
// thread rounds stays as it was.
#pragma once

#include <new>
#include <string>

#include "core/base/error.h"
#include "core/base/float_control.h"
#include "core/plugin/registry.h"

namespace sim {

// The exception that is being handled, as an error of `who` ("force 'spring' of spring.so") in
// `what`
// ("its constructor"). Errors, and memory that ran out, pass as they are.
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
