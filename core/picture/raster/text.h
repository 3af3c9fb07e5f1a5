// Words and rectangles on the finished picture, with a font of strokes.
#pragma once

#include "core/picture/picture.h"
#include "core/picture/raster/raster.h"
#include "core/picture/raster/tone.h"

namespace sim::raster {

void draw_patches(const Picture& picture, const Tone& tone, Image& image);
void draw_texts(const Picture& picture, const Tone& tone, Image& image);

// Pixels of one unit of words and rectangles: small pictures have larger words.
float text_scale(int height);

// The width of a text with capitals of height 1.
float text_width(const std::string& text);

}  // namespace sim::raster
