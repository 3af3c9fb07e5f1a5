// Images as PNG files (ISO/IEC 15948).
#pragma once

#include <functional>
#include <string>

#include "core/picture/raster/raster.h"

namespace sim {

// The whole file: eight bits of red, green and blue, sRGB.
// A stop() is asked between parts of large pictures; true ends it, and the text is empty.
std::string png(const Image& image, const std::function<bool()>& stop = {});

}  // namespace sim
