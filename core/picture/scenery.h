// Turns models and moments into pictures, all from one viewpoint with one scale of colours.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "core/picture/quantity.h"
#include "core/picture/viewpoint.h"

namespace sim {

class Scenery {
 public:
  // All arguments outlive it, and there is at least one moment. Throws Error{kUsage} for a
  // particle, a family or a quantity that no system has.
  Scenery(std::span<const Model> models, const Moments& moments, const Look& look);

  Picture picture(std::size_t moment) const;

  // Replaces the viewpoint or scale: panels side by side share them.
  void set_viewpoint(const Viewpoint& viewpoint) { viewpoint_ = viewpoint; }
  void set_scale(const ColourScale& scale) { scale_ = scale; }
  void set_picked(std::vector<int> ids) { look_.picked = std::move(ids); }  // that have springs
  const Viewpoint& viewpoint() const { return viewpoint_; }
  const ColourScale& scale() const { return scale_; }
  // Replaces the system's name, method and time by these words.
  void set_caption(std::vector<std::string> lines) { caption_ = std::move(lines); }

 private:
  bool shows_back(std::size_t system) const;
  void find_liquids();
  void surfaces(Picture& picture, std::size_t system, const Frame& frame) const;
  void liquid(Picture& picture, std::size_t system, const Frame& frame) const;
  void loose(Picture& picture, std::size_t system, const Frame& frame) const;
  void follow(std::size_t system);  // trails_ := the ways of what leaves trails
  void trails(Picture& picture, std::size_t system, std::size_t moment) const;
  void springs(Picture& picture, std::size_t system, const Frame& frame) const;
  void wires(Picture& picture, std::size_t system, const Frame& frame) const;
  void solids(Picture& picture, std::size_t system, const Frame& frame) const;
  void words(Picture& picture, const Moment& moment) const;
  std::vector<std::string> warnings(const Moment& moment) const;
  V3 place(std::size_t system, const Vec3& x) const {
    return viewpoint_.point(x + viewpoint_.offsets[system]);
  }
  bool picked(int particle) const;

  std::span<const Model> models_;
  Moments moments_;
  Look look_;
  std::vector<bool> turned_;                            // systems whose surface would show its back
  std::vector<std::vector<std::array<int, 2>>> wires_;  // of each system, if they are drawn
  struct Liquid {
    std::vector<int> ids;
    double spacing;  // m
  };
  std::vector<Liquid> liquids_;  // of each system, if they are drawn as surfaces
  struct Path {
    unsigned fresh, faded;          // colours of its end and of its beginning
    std::vector<Vec3> points;       // m
    std::vector<std::size_t> ends;  // how many there are up to each moment
  };
  std::vector<std::vector<Path>> trails_;  // of each system
  Viewpoint viewpoint_;
  ColourScale scale_;
  std::vector<std::string> caption_;
};

// The colour of the springs of a family, 0xRRGGBB: the i-th of a model.
unsigned family_colour(std::size_t i);

// Edges of a mesh that stay sharp, as pairs of its points: those where two faces that are turned by
// more than 40 degrees meet, and those of one face.
std::vector<std::array<int, 2>> sharp_edges(const RigidShape& mesh);

// Adds a solid to a picture, its sharp edges as lines; of a room the edges alone.
void add_solid(Picture& picture, const RenderShape& solid, const Viewpoint& viewpoint,
               const Vec3& offset, int skin);

}  // namespace sim
