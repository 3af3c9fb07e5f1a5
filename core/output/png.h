// Images as PNG files (ISO/IEC 15948).
#pragma once

#include <string>

#include "core/picture/raster/raster.h"

namespace sim {

// The whole file: eight bits of red, green and blue, sRGB.
std::string png(const Image& image);

}  // namespace sim
