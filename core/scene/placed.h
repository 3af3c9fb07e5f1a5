// Errors of what a part of a scene is made by, with the place of the part.
#pragma once

#include "core/base/error.h"
#include "core/plugin/params.h"

namespace sim {

// What make() returns. An error that it throws without a place gets this one.
template <class Make>
auto placed(const Place& place, Make make) {
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
