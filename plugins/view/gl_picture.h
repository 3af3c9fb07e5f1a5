// A picture drawn by OpenGL 3.3: what the rasteriser draws, at the speed of a graphics card. Its
// shadows are flat ones on the ground.
#pragma once

#include <epoxy/gl.h>

#include <array>
#include <vector>

#include "core/picture/picture.h"

// Needs a current context for its whole life.
class GlPicture {
 public:
  GlPicture();  // throws Error{kIo} with the message of the shader compiler
  ~GlPicture();
  GlPicture(const GlPicture&) = delete;
  GlPicture& operator=(const GlPicture&) = delete;

  // Into a rectangle of the frame buffer, in pixels from its lower left corner. Words and patches
  // are left to the caller.
  void draw(const sim::Picture& picture, int x, int y, int width, int height);

 private:
  struct Attribute {
    int count;      // floats
    bool instance;  // of the whole thing, not of its corners
  };
  void ground(const sim::Picture& picture);
  void upload_surfaces(const sim::Picture& picture);
  void surfaces(const sim::Picture& picture, bool shadow);
  void balls(const sim::Picture& picture, bool shadow);
  void lines(const sim::Picture& picture, int width, int height);
  unsigned use(unsigned program, const sim::Picture& picture) const;
  void flatten(unsigned program, const sim::Picture& picture, bool on) const;
  static void set(unsigned program, const char* name, const sim::V3& value);
  static void describe(unsigned buffer, const std::vector<float>& data,
                       const std::vector<Attribute>& attributes, int first = 0);

  unsigned mesh_, ball_, line_, ground_;
  unsigned array_ = 0;
  std::array<unsigned, 4> buffers_{};
  std::array<float, 16> view_{};
  float depth_ = 0;  // the loss of depth for each share by which a point comes nearer
  std::vector<float> corners_, tints_, instances_, sphere_;
  std::vector<unsigned> indices_;
  struct Part {  // triangles of one skin
    int skin;
    bool visible;
    std::size_t first, count;
  };
  std::vector<Part> parts_;
};
