// `sim doctor`: is everything there that a run needs?
#pragma once

#include "cli/run/environment.h"
#include "cli/terminal/console.h"

namespace sim::cli {

struct DoctorRequest {
  Folders libraries;  // --load
  bool json = false;
};

// Opens every plugin, reads and steps the default scene, and says what it found. 0, or 5 when
// something is wrong.
int doctor(const DoctorRequest& request, const Environment& environment, Console& console);

}  // namespace sim::cli
