// Adds the source location of a part of a scene to errors that occur while it is made.
#pragma once

#include "core/base/error.h"
#include "core/plugin/params.h"

namespace sim {

// Returns make(). An error that it throws without a source location gets this one.
template <class Make>
auto at_source(const SourceLocation& place, Make make) {
  try {
    return make();
  } catch (const Error& error) {
    ErrorText text = error.text();
    if (!text.where.empty()) throw;
    text.where = place;
    throw Error(error.kind(), text);
  }
}

}  // namespace sim
