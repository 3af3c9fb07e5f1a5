// Do the window and the rasteriser draw the same things at the same places?
//
//   sim_silhouette SCENE.lua ...
//
// A silhouette is what differs from the picture with nothing in it; the overlap is what both cover
// over what either covers, and `to a pixel` lets what is beside count, too: edges and thin lines
// have their samples at other places. It needs a display. Exit code 1 where a scene is drawn too
// differently, or not at all.
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <cstdio>
#include <ctime>

#include "core/lua/scene/scene_file.h"
#include "core/output/front.h"
#include "core/picture/raster/raster.h"
#include "core/scene/simulation.h"
#include "plugins/view/gl_picture.h"

namespace {

constexpr int kWidth = 960, kHeight = 640;
constexpr double kLeast = 0.995;       // of the overlap to a pixel
constexpr double kLeastStrict = 0.99;  // of the overlap, of what covers much
constexpr double kMuch = 0.2, kLittle = 5e-4;
constexpr double kTime = 0.4;  // s, that a scene runs before it is looked at
constexpr int kLooks = 8;      // on the way, for the camera

// A frame buffer of its own with four samples a pixel, as the window has.
class Canvas {
 public:
  Canvas() {
    glGenFramebuffers(2, frames_);
    glGenRenderbuffers(3, buffers_);
    attach(0, GL_COLOR_ATTACHMENT0, GL_RGB8, 4);
    attach(0, GL_DEPTH_STENCIL_ATTACHMENT, GL_DEPTH24_STENCIL8, 4);
    attach(1, GL_COLOR_ATTACHMENT0, GL_RGB8, 0);
  }

  sim::Image draw(const sim::Picture& picture) {
    glBindFramebuffer(GL_FRAMEBUFFER, frames_[0]);
    drawing_.draw(picture, 0, 0, kWidth, kHeight);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, frames_[0]);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, frames_[1]);
    glBlitFramebuffer(0, 0, kWidth, kHeight, 0, 0, kWidth, kHeight, GL_COLOR_BUFFER_BIT,
                      GL_NEAREST);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, frames_[1]);
    sim::Image image{kWidth, kHeight, std::vector<std::uint8_t>(3UL * kWidth * kHeight)};
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glReadPixels(0, 0, kWidth, kHeight, GL_RGB, GL_UNSIGNED_BYTE, image.rgb.data());
    for (int y = 0; y < kHeight / 2; ++y)  // rows from the top
      std::swap_ranges(image.rgb.begin() + 3L * kWidth * y,
                       image.rgb.begin() + 3L * kWidth * (y + 1),
                       image.rgb.end() - 3L * kWidth * (y + 1));
    return image;
  }

 private:
  void attach(int frame, GLenum where, GLenum what, int samples) {
    glBindFramebuffer(GL_FRAMEBUFFER, frames_[frame]);
    const unsigned buffer = buffers_[next_++];
    glBindRenderbuffer(GL_RENDERBUFFER, buffer);
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples, what, kWidth, kHeight);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, where, GL_RENDERBUFFER, buffer);
  }

  GlPicture drawing_;
  unsigned frames_[2] = {}, buffers_[3] = {};
  int next_ = 0;
};

struct Look {
  sim::Picture picture, empty;
};

// The scene after kTime, without ground (shadows on it are no silhouettes) and words.
Look look_at(const std::string& file, sim::Registry& registry) {
  sim::SceneSpec spec =
      sim::load_scene(file, registry, {{std::filesystem::path(SIM_SOURCE_DIR) / "scripts"}, {}, 0});
  std::vector<sim::Simulation> systems;
  std::vector<sim::Model> models;
  sim::ViewState state;
  for (const sim::SystemSpec& each : spec.systems) {
    models.push_back(sim::make_model(each, systems.emplace_back(each, registry)));
    state.systems.emplace_back().h = systems.back().h();
  }
  std::vector<sim::Moment> preview;
  for (int k = 0; k <= kLooks; ++k) {
    preview.emplace_back();
    for (sim::Simulation& system : systems) {
      while (system.t() < k * kTime / kLooks && system.step()) {}
      preview.back().push_back(sim::take_frame(system));
    }
  }
  sim::ViewScene scene;
  scene.world = systems.size() > 1;
  scene.models = models;
  scene.preview = preview;
  sim::Front front(scene, 8);
  front.resize(kWidth, kHeight);
  front.show(preview.back(), state);
  Look look{front.picture(), {}};
  look.picture.ground.reset();
  look.picture.texts.clear();
  look.picture.patches.clear();
  look.empty.eye = look.picture.eye;
  look.empty.light = look.picture.light;
  return look;
}

bool at(const std::vector<bool>& pixels, int i) { return pixels[static_cast<std::size_t>(i)]; }

bool near(const std::vector<bool>& pixels, int i) {
  bool found = false;
  for (int y = std::max(0, i / kWidth - 1); y <= std::min(kHeight - 1, i / kWidth + 1); ++y)
    for (int x = std::max(0, i % kWidth - 1); x <= std::min(kWidth - 1, i % kWidth + 1); ++x)
      found = found || at(pixels, y * kWidth + x);
  return found;
}

std::vector<bool> silhouette(const sim::Image& image, const sim::Image& empty) {
  std::vector<bool> differs(std::size_t{kWidth} * kHeight);
  for (std::size_t i = 0; i < differs.size(); ++i)
    for (std::size_t c = 3 * i; c < 3 * i + 3; ++c)
      differs[i] = differs[i] || std::abs(image.rgb[c] - empty.rgb[c]) > 2;
  return differs;
}

// Lines and balls that reach beyond a million metres are left out whole, whichever end does.
bool leaves_out_what_is_far(Canvas& canvas, sim::Picture picture) {
  const sim::Eye& eye = picture.eye;
  const sim::V3 near = eye.at + 2 * eye.forward, red{1, 0, 0};  // in the middle of the picture
  const sim::Image before = canvas.draw(picture);
  for (const sim::V3& far : {sim::V3{2e6F, 0, 0}, sim::V3{0, -2e6F, 0}, sim::V3{0, 0, NAN}}) {
    picture.lines.push_back({.a = near, .b = far, .width = 9, .colour = red, .in_front = true});
    picture.lines.push_back({.a = far, .b = near, .width = 9, .colour = red, .in_front = true});
    picture.balls.push_back({.centre = far, .radius = 3e6F, .colour = red});
  }
  const bool same = canvas.draw(picture).rgb == before.rgb;
  picture.lines.push_back({.a = near, .b = near + 0.2F * eye.right, .width = 9, .colour = red});
  return same && canvas.draw(picture).rgb != before.rgb;
}

int compare(const std::vector<std::string>& files) {
  Canvas canvas;
  sim::Registry registry({SIM_PLUGIN_DIR});
  int worse = 0;
  for (const std::string& file : files) {
    const Look look = look_at(file, registry);
    sim::Raster raster(kWidth, kHeight);
    const sim::Image nothing = raster.draw(look.empty);
    const std::vector<bool> ours = silhouette(raster.draw(look.picture), nothing);
    const sim::Image bare = canvas.draw(look.empty);
    const std::clock_t before = std::clock();
    const std::vector<bool> theirs = silhouette(canvas.draw(look.picture), bare);
    const double ms = 1e3 * static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
    double both = 0, beside = 0, either = 0;
    for (int i = 0; i < kWidth * kHeight; ++i) {
      const bool a = at(ours, i), b = at(theirs, i);
      both += a && b;
      beside += (a && near(theirs, i)) || (b && near(ours, i));
      either += a || b;
    }
    const double covered = either / (double{kWidth} * kHeight), overlap = both / either;
    if (!leaves_out_what_is_far(canvas, look.empty)) {
      std::printf("%-28s what is far is drawn\n", file.c_str());
      ++worse;
    }
    std::printf("%-28s covers %.3f, overlap %.4f, to a pixel %.4f, %.0f ms\n", file.c_str(),
                covered, overlap, beside / either, ms);
    worse += !(covered > kLittle) || beside < kLeast * either ||
             (covered > kMuch && overlap < kLeastStrict);
  }
  return worse ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (!glfwInit()) return std::fputs("no display\n", stderr), 5;
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
  GLFWwindow* window = glfwCreateWindow(64, 64, "silhouette", nullptr, nullptr);
  if (!window) return std::fputs("no OpenGL 3.3\n", stderr), 5;
  glfwMakeContextCurrent(window);
  const int code = compare({argv + 1, argv + argc});
  glfwTerminate();
  return code;
}
