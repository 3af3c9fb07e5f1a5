// A force that acts on some particles alone.
#pragma once

#include <memory>
#include <vector>

#include "core/particles/force.h"

namespace sim {

// `force` on the given particles, nothing on the others. The force on a particle must depend on
// that particle alone. ids ascending, each once, in [0, n).
std::unique_ptr<Force> make_group(std::unique_ptr<Force> force, const std::vector<int>& ids);

}  // namespace sim
