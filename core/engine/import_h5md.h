// A file of H5MD as a scene.
#pragma once

#include "core/engine/import_file.h"

namespace sim::engine {

// See import_file().
void import_h5md(const ImportTask& task);

}  // namespace sim::engine
