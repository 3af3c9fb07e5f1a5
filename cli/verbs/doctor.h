// `sim doctor`: checks that everything needed for a run is there.
#pragma once

#include "cli/run/environment.h"
#include "cli/terminal/console.h"

namespace sim::cli {

struct DoctorRequest {
  Folders libraries;  // --load
  bool json = false;
};

// Opens every plugin, reads and steps the default scene, and reports. Returns 0, or 5 if something
// is wrong.
int doctor(const DoctorRequest& request, const Environment& environment, Console& console);

}  // namespace sim::cli
