// Linear light and the eight bits of a screen (sRGB, IEC 61966-2-1), without the C library's
// powers.
#pragma once

#include <array>
#include <cstdint>

#include "core/picture/raster/v3.h"

namespace sim::raster {

class Tone {
 public:
  Tone();

  // The pixel (x, y) of an 8-bit image; values between two levels are dithered over 4 x 4 pixels,
  // and light above 0.8 is compressed below 1.
  void put(const V3& light, int x, int y, std::uint8_t* rgb) const {
    static constexpr int kSpread[16] = {0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5};
    const int spread = kSpread[(y & 3) * 4 + (x & 3)];
    rgb[0] = one(light.x, spread);
    rgb[1] = one(light.y, spread);
    rgb[2] = one(light.z, spread);
  }

  float light(std::uint8_t value) const { return light_[value]; }

  static double encode(double light);   // 0 .. 1 -> 0 .. 1
  static double decode(double screen);  // the other way

 private:
  std::uint8_t one(float light, int spread) const {
    if (!(light > 0)) light = 0;
    if (light > 1e6F) light = 1e6F;
    if (light > 0.8F) light = 0.8F + 0.2F * ((light - 0.8F) / (light - 0.6F));
    return static_cast<std::uint8_t>((screen_[static_cast<int>(light * 4096)] + spread) >> 4);
  }

  std::array<std::uint16_t, 4097> screen_{};  // 16 * 255 at most
  std::array<float, 256> light_{};
};

}  // namespace sim::raster
