#include "core/picture/raster/text.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "core/picture/raster/samples.h"

namespace sim::raster {
namespace {

// A glyph for each character from the space to the tilde: its width, then strokes of points, a
// digit for x and a letter for y: a = -3, d = 0 the baseline, k = 7 the small letters, n = 10 the
// capitals.
constexpr std::array<std::string_view, 95> kGlyphs{
    "3",                                     // space
    "2 1n1g;1d1d",                           // !
    "2 0n0l;2n2l",                           // "
    "6 1d2n;4d5n;0j6j;0g6g",                 // #
    "6 6l4n2n0l0k2i4i6g6f4d2d0f;3o3c",       // $
    "8 1d7n;2n0m0l2k3l3m2n;6g5f5e6d8e8f6g",  // %
    "6 6d1k1m2n3n4m4l0g0e1d3d6h",            // &
    "1 0n0l",                                // '
    "2 2n0k0f2c",                            // (
    "2 0n2k2f0c",                            // )
    "4 2n2i;0m4j;4m0j",                      // *
    "6 0h6h;3k3e",                           // +
    "1 1d0b",                                // ,
    "4 0h4h",                                // -
    "1 0d0d",                                // .
    "4 0c4n",                                // /
    "6 2d1e0g0k1m2n4n5m6k6g5e4d2d",          // 0
    "4 0l3n3d",                              // 1
    "6 0l1m2n4n5m6l6k5i0d6d",                // 2
    "6 0m1n4n6m6k5j3i4i6h6f5d1d0e",          // 3
    "6 4d4n0g6g",                            // 4
    "6 5n1n0i2j4j6i6f5d1d0e",                // 5
    "6 5n3n1l0i0f1d5d6f6h5j1j0h",            // 6
    "6 0n6n2d",                              // 7
    "6 1i0k0m1n5n6m6k5i1i0g0e1d5d6e6g5i",    // 8
    "6 6i5h1h0j0l1n5n6l6i5f3d1d",            // 9
    "1 0d0d;0j0j",                           // :
    "1 1d0b;1j1j",                           // ;
    "5 5k0h5e",                              // <
    "6 0j6j;0g6g",                           // =
    "5 0k5h0e",                              // >
    "5 0l1n4n5l5k3i3g;3d3d",                 // ?
    "8 6g6j4k2i2g4f6g7g8i8k6n2n0k0f2d5d",    // @
    "6 0d3n6d;1g5g",                         // A
    "6 0d0n4n5m5k4i0i;4i6h6e5d0d",           // B
    "6 6l5m4n2n1m0k0g1e2d4d5e6f",            // C
    "6 0d0n3n5m6k6g5e3d0d",                  // D
    "5 5n0n0d5d;0i4i",                       // E
    "5 5n0n0d;0i4i",                         // F
    "6 6l5m4n2n1m0k0g1e2d4d5e6f6i4i",        // G
    "6 0d0n;6d6n;0i6i",                      // H
    "1 0d0n",                                // I
    "4 4n4f3d1d0f",                          // J
    "6 0d0n;6n0h;2j6d",                      // K
    "5 0n0d5d",                              // L
    "8 0d0n4f8n8d",                          // M
    "6 0d0n6d6n",                            // N
    "6 2d1e0g0k1m2n4n5m6k6g5e4d2d",          // O
    "6 0d0n4n6m6k4i0i",                      // P
    "6 2d1e0g0k1m2n4n5m6k6g5e4d2d;4f7c",     // Q
    "6 0d0n4n6m6k4i0i;3i6d",                 // R
    "6 6l5m4n2n1n0l0k1j5h6g6f5d1d0f",        // S
    "6 0n6n;3n3d",                           // T
    "6 0n0f1d5d6f6n",                        // U
    "6 0n3d6n",                              // V
    "8 0n2d4m6d8n",                          // W
    "6 0n6d;6n0d",                           // X
    "6 0n3i6n;3i3d",                         // Y
    "6 0n6n0d6d",                            // Z
    "2 2n0n0c2c",                            // [
    "4 0n4c",                                // backslash
    "2 0n2n2c0c",                            // ]
    "4 0k2n4k",                              // ^
    "6 0c6c",                                // _
    "2 0n2l",                                // `
    "5 0j1k4k5j5d;5h1h0g0e1d3d5f",           // a
    "5 0n0d;0i2k4k5i5f4d2d0f",               // b
    "5 5j4k1k0i0f1d4d5e",                    // c
    "5 5n5d;5i3k1k0i0f1d3d5f",               // d
    "5 0h5h5i4k1k0i0f1d4d5e",                // e
    "4 4n3n2m2d;0k4k",                       // f
    "5 5k5b4a1a0b;5i3k1k0i0f1d3d5f",         // g
    "5 0n0d;0i2k4k5i5d",                     // h
    "1 0k0d;0n0n",                           // i
    "2 2k2b1a0a;2n2n",                       // j
    "5 0n0d;5k0g;2h5d",                      // k
    "2 0n0e1d2d",                            // l
    "8 0k0d;0i2k3k4i4d;4i6k7k8i8d",          // m
    "5 0k0d;0i2k4k5i5d",                     // n
    "5 1d0f0i1k4k5i5f4d1d",                  // o
    "5 0k0a;0i2k4k5i5f4d2d0f",               // p
    "5 5k5a;5i3k1k0i0f1d3d5f",               // q
    "4 0k0d;0h2k4k",                         // r
    "5 5j4k1k0j0i5g5e4d1d0e",                // s
    "4 2n2e3d4d;0k4k",                       // t
    "5 0k0f1d3d5f;5k5d",                     // u
    "5 0k3d5k",                              // v
    "8 0k2d4j6d8k",                          // w
    "5 0k5d;5k0d",                           // x
    "5 0k3d;5k2b1a0a",                       // y
    "5 0k5k0d5d",                            // z
    "3 3n2n1m1j0i1h1e2c3c",                  // {
    "1 0n0c",                                // |
    "3 0n1n2m2j3i2h2e1c0c",                  // }
    "6 0h1i2i4g5g6h",                        // ~
};

constexpr float kGap = 3.0F;  // between glyphs, tenths of a capital

std::string_view glyph(char c) {
  const int index = c - ' ';
  return kGlyphs[static_cast<std::size_t>(index < 0 || index > 94 ? '?' - ' ' : index)];
}

// The colour of a pixel moved by a share of the way towards another, in linear light.
void blend(const Tone& tone, unsigned rgb, float share, std::uint8_t* pixel) {
  for (int c = 0; c < 3; ++c) {
    const float to = tone.light(static_cast<std::uint8_t>((rgb >> (16 - 8 * c)) & 255U));
    const float mixed = tone.light(pixel[c]) + share * (to - tone.light(pixel[c]));
    // Back by halving: the table of light rises.
    int low = 0, high = 255;
    while (low < high) {
      const int middle = (low + high + 1) / 2;
      if (tone.light(static_cast<std::uint8_t>(middle)) <= mixed + 1e-6F)
        low = middle;
      else
        high = middle - 1;
    }
    if (low < 255 && tone.light(static_cast<std::uint8_t>(low + 1)) - mixed <
                         mixed - tone.light(static_cast<std::uint8_t>(low)))
      ++low;
    pixel[c] = static_cast<std::uint8_t>(low);
  }
}

std::uint8_t* pixel_of(Image& image, int x, int y) {
  return image.rgb.data() +
         3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
              static_cast<std::size_t>(x));
}

struct Pen {
  float x, y, unit, half;  // pixels: origin of the glyph, a tenth of a capital, half the stroke
};

// Every pixel by its distance from the nearest stroke.
void draw_glyph(const Tone& tone, std::string_view strokes, const Pen& pen, unsigned rgb,
                Image& image) {
  const int left = to_int(pen.x - pen.half - 1, 0, image.width),
            right = to_int(pen.x + 9 * pen.unit + pen.half + 2, 0, image.width),
            top = to_int(pen.y - 11 * pen.unit - pen.half - 1, 0, image.height),
            bottom = to_int(pen.y + 3 * pen.unit + pen.half + 2, 0, image.height);
  const auto x_of = [&](std::size_t i) {
    return pen.x + static_cast<float>(strokes[i] - '0') * pen.unit;
  };
  const auto y_of = [&](std::size_t i) {
    return pen.y - static_cast<float>(strokes[i + 1] - 'd') * pen.unit;
  };
  for (int y = top; y < bottom; ++y)
    for (int x = left; x < right; ++x) {
      const float px = static_cast<float>(x) + 0.5F, py = static_cast<float>(y) + 0.5F;
      float nearest = 1e9F;
      for (std::size_t i = 0; i + 3 < strokes.size(); i += 2) {
        if (strokes[i + 2] == ';') {
          ++i;
          continue;
        }
        const float ax = x_of(i), ay = y_of(i), dx = x_of(i + 2) - ax, dy = y_of(i + 2) - ay;
        const float dd = dx * dx + dy * dy;
        const float s = dd > 0 ? clamp01(((px - ax) * dx + (py - ay) * dy) / dd) : 0;
        const float ex = px - ax - s * dx, ey = py - ay - s * dy;
        nearest = std::min(nearest, ex * ex + ey * ey);
      }
      const float share = clamp01(pen.half + 0.5F - std::sqrt(nearest));
      if (share > 0) blend(tone, rgb, share, pixel_of(image, x, y));
    }
}

}  // namespace

float text_scale(int height) { return static_cast<float>(std::max(height, 420)) / 720; }

float text_width(const std::string& text) {
  float width = 0;
  for (const char c : text) width += static_cast<float>(glyph(c)[0] - '0') + kGap;
  return text.empty() ? 0 : (width - kGap) / 10;
}

void draw_texts(const Picture& picture, const Tone& tone, Image& image) {
  const float scale = text_scale(image.height);
  for (const PictureText& text : picture.texts) {
    const float size = text.size * scale;
    Pen pen{text.x * scale, text.y * scale, size / 10,
            std::max(0.5F, size * (text.bold ? 0.085F : 0.058F))};
    pen.x -= 0.5F * static_cast<float>(text.align) * size * text_width(text.text);
    for (const char c : text.text) {
      const std::string_view all = glyph(c);
      if (all.size() > 2) draw_glyph(tone, all.substr(2), pen, text.rgb, image);
      pen.x += (static_cast<float>(all[0] - '0') + kGap) * pen.unit;
    }
  }
}

void draw_patches(const Picture& picture, const Tone& tone, Image& image) {
  const float scale = text_scale(image.height);
  for (const PicturePatch& patch : picture.patches) {
    if (patch.rgb.empty()) continue;
    const int left = to_int(patch.x * scale + 0.5F, 0, image.width),
              right = to_int((patch.x + patch.width) * scale + 0.5F, 0, image.width),
              top = to_int(patch.y * scale + 0.5F, 0, image.height),
              bottom = to_int((patch.y + patch.height) * scale + 0.5F, 0, image.height);
    for (int y = top; y < bottom; ++y)
      for (int x = left; x < right; ++x) {
        const auto count = static_cast<int>(patch.rgb.size());
        const int at = std::min(count - 1, (x - left) * count / (right - left));
        blend(tone, patch.rgb[static_cast<std::size_t>(at)], patch.opacity, pixel_of(image, x, y));
      }
  }
}

}  // namespace sim::raster
