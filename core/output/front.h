// A view that draws by itself: it turns keys and mouse into words, and moments into a picture. A
// window and a terminal share it.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/output/view.h"
#include "core/picture/scenery.h"

namespace sim {

// Positions are in pixels of the picture, from its upper left corner.
struct FrontEvent {
  enum class What { kKey, kPress, kMove, kRelease, kLook } what = What::kKey;
  std::string key = {};  // "q", "Left", "Space", ...
  float x = 0, y = 0;
  bool moves = false;  // a press that moves the eye, not the scene
  bool shift = false, control = false;
};

struct FrontKey {
  const char *keys, *does;
};

class Front {
 public:
  // The objects of the scene outlive it, or renew(). `reach`: distance in pixels at which a click
  // still finds a particle.
  Front(const ViewScene& scene, float reach);
  void renew(const ViewScene& scene);  // the eye stays

  void resize(int width, int height);
  void show(const Moment& moment, const ViewState& state);
  // Words for the runner of the scene, in their order.
  std::vector<std::string> take(const FrontEvent& event);
  void zoom(float factor) { distance_ *= factor; }
  bool closed() const { return closed_; }
  bool help() const { return help_; }
  static const std::vector<FrontKey>& keys();

  Picture picture();  // once something was shown; its words are the names and the scale
  // The system that it describes: that of the picked particle, or the first.
  std::size_t chosen() const { return picked_ ? picked_->system : 0; }
  std::optional<int> picked() const;
  std::string name(std::size_t system) const;  // before a word, where it needs one

  // The position of a particle in the picture, for tests.
  V3 pixel(std::size_t system, int particle) const;

 private:
  struct Spot {
    std::size_t system = 0;
    int particle = -1;
    float depth = 0;  // along the ray
  };
  std::vector<std::string> key(std::string key);
  std::vector<std::string> switched() const;
  std::optional<Spot> under(float x, float y) const;
  std::optional<Spot> beside(float x, float y) const;
  V3 ray(float x, float y) const;
  V3 place(std::size_t system, int particle) const;
  std::string pull(float x, float y) const;
  void turn();
  void begin_scene();
  std::string colour_now() const;
  void colour_on(std::vector<std::string>& words);
  std::size_t seen(std::size_t system) const;  // its index among the visible ones
  void flatten(Picture& picture) const;

  ViewScene scene_;
  float reach_;
  Moment moment_;
  ViewState state_;
  Look look_;
  std::vector<bool> hidden_;
  std::vector<Model> models_;  // of the visible parts, with the present pins
  std::vector<Moment> now_;    // the same
  std::unique_ptr<Scenery> scenery_;
  Viewpoint base_, view_;
  float yaw_ = 0, pitch_ = 0, distance_ = 1;
  V3 at_;
  std::string shown_colour_;
  double most_ = 0;  // of its scale
  std::optional<Spot> held_, picked_;
  bool pinning_ = false, turning_ = false, moving_ = false, closed_ = false, help_ = false;
  bool springs_ = true, flat_ = false;
  int wire_ = 0;         // 1: wires alone, 2: on the surface
  float x_ = 0, y_ = 0;  // of the mouse
};

}  // namespace sim
