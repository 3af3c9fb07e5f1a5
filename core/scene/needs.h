// What a system will need of memory, known from its description before anything is compiled.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/ode/integrator.h"
#include "core/plugin/registry.h"
#include "core/scene/scene_spec.h"

namespace sim {

// Bytes, as measured of running systems: what is sure to be needed, not what may be.
struct Needs {
  std::vector<std::pair<std::string, double>> parts;  // "particles", "springs", ...

  double total() const;
  std::string text() const;  // "particles 9.6 GB, springs 2 GB", the largest first
};

Needs needs_of(const SystemSpec& spec, const IntegratorInfo& method, Registry& registry);
// Besides those of the system: of so many files of frames.
Needs needs_of_files(const SystemSpec& spec, int files);

// Throws Error{kIo} where that is more than is left.
void require_room(const SystemSpec& spec, const IntegratorInfo& method, Registry& registry);
void require_room_for_files(const SystemSpec& spec, int files);

}  // namespace sim
