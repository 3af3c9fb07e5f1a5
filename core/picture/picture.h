// A picture before rasterisation: triangles, lines and balls around the origin in units of the
// scene's size, the ground, words on top, and the camera. Rasteriser and terminal use nothing else.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/picture/raster/v3.h"

namespace sim {

using raster::V3;

// Linear light, 0 .. 1 each, from the eight bits of a screen: 0xRRGGBB.
V3 colour(unsigned rgb);

struct Eye {
  V3 at, right{1, 0, 0}, up{0, 1, 0}, forward{0, 0, -1};  // three right angles, of length 1
  float focal = 3.5F;  // half the height of the picture is 1 / focal at distance 1
};

// The two sides of a surface. If the picture has colours of points, the front takes them.
struct Skin {
  V3 front, back;
  bool two_sided_colour = true;  // the back takes colours of points, too
  float gloss = 0;               // 0 .. 1, of the highlight
};

struct PictureTriangle {
  std::array<int, 3> points;
  int skin = 0;
  bool visible = true;  // or it only casts a thin shadow
  bool casts = true;
};

struct PictureLine {
  V3 a, b;
  float width = 1;  // in 1/720 of the picture's height
  V3 colour;
  bool in_front = false;  // drawn over items up to slightly nearer
};

struct PictureBall {
  V3 centre;
  float radius = 0;
  V3 colour;
  bool casts = true;  // a shadow
};

struct Ground {
  V3 origin, u{1, 0, 0}, up{0, 1, 0}, w{0, 0, 1};  // three right angles, of length 1
  float spacing = 0.25F;                           // of its grid
  float fade = 8;                                  // distance at which it ends in mist
};

// Words on the finished picture: x, y of the left end of the baseline, from the upper left corner,
// and the size of a capital, in 1/720 of the height; low pictures count as 420 pixels.
struct PictureText {
  std::string text;
  float x = 0, y = 0, size = 12;
  unsigned rgb = 0x303840;
  int align = 0;  // 0: x is the left end, 1: the middle, 2: the right end
  bool bold = false;
};

// A filled rectangle in the same units, on top but below the words.
struct PicturePatch {
  float x = 0, y = 0, width = 0, height = 0;
  std::vector<unsigned> rgb;  // from left to right
  float opacity = 1;
};

struct Picture {
  Eye eye;
  V3 light{0.4F, 0.8F, 0.45F};  // towards the key light, of length 1
  std::vector<V3> points, normals;
  std::vector<V3> colours;  // of the points, or empty
  std::vector<Skin> skins;
  std::vector<PictureTriangle> triangles;
  std::vector<PictureLine> lines;
  std::vector<PictureBall> balls;
  std::optional<Ground> ground;
  std::vector<PicturePatch> patches;
  std::vector<PictureText> texts;
};

}  // namespace sim
