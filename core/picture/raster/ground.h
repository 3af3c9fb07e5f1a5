// The background: a sky, and a ground with a grid that fades into mist.
#pragma once

#include "core/base/cancellation.h"
#include "core/picture/raster/samples.h"
#include "core/picture/raster/tone.h"

namespace sim::raster {

// Drawn once for each eye and ground.
class Backdrop {
 public:
  Backdrop(int width, int height);

  void draw(const Picture& picture, const Projection& projection, const Tone& tone,
            Cancellation& cancellation);

  const V3& light(int x, int y) const { return light_[at(x, y)]; }
  const std::vector<std::uint8_t>& screen() const { return screen_; }
  // The point, relative to its origin, at which a pixel's ray meets the ground; `clear`: the light
  // left by a shadow there, 0 for the sky.
  struct Spot {
    float u = 0, w = 0, clear = 0;
  };
  const Spot& spot(int x, int y) const { return spots_[at(x, y)]; }

 private:
  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  }
  V3 sky(const V3& direction) const;
  float distance(const V3& direction) const;  // of the ground along a ray; 0 where there is none
  float clear(float distance) const;
  V3 grid(float u, float v, float width) const;

  int width_, height_;
  bool drawn_ = false;
  Eye eye_;
  std::optional<Ground> ground_;
  float above_ = 0;  // the eye over the ground
  std::vector<V3> light_;
  std::vector<Spot> spots_;
  std::vector<std::uint8_t> screen_;
};

}  // namespace sim::raster
