// An estimate of the memory of a system, from its description before anything is compiled.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/ode/integrator.h"
#include "core/plugin/registry.h"
#include "core/scene/scene_spec.h"

namespace sim {

// Bytes, as measured of running systems: a lower bound of the need.
struct MemoryEstimate {
  std::vector<std::pair<std::string, double>> parts;  // "particles", "springs", ...

  double total() const;
  std::string text() const;  // "particles 9.6 GB, springs 2 GB", the largest first
};

MemoryEstimate memory_estimate(const SystemSpec& spec, const IntegratorInfo& method,
                               Registry& registry);
// The additional need of so many files of frames.
MemoryEstimate memory_estimate_of_files(const SystemSpec& spec, int files);

// Throws Error{kIo} if that is more than is left.
void require_room(const SystemSpec& spec, const IntegratorInfo& method, Registry& registry);
void require_room_for_files(const SystemSpec& spec, int files);

}  // namespace sim
