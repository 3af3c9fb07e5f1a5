// The pictures of a run: all systems in one, or each in a panel of its own, with one viewpoint and
// one scale of colours for all.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/picture/panels.h"
#include "core/picture/raster/raster.h"
#include "core/picture/scenery.h"

namespace sim {

// Columns and rows for so many panels.
struct PanelGrid {
  int columns = 1, rows = 1;
};
PanelGrid panel_grid(int panels);

class Gallery {
 public:
  // All arguments outlive it, as in Scenery.
  Gallery(std::span<const Model> models, const Moments& moments, const Look& look,
          const Panels& panels = {});

  // Draws the same pictures on another thread; the analysis of the run is shared.
  Gallery(const Gallery& other);

  void stop_when(std::function<bool()> stop);  // as Raster::stop_when; not shared with copies

  // Valid until the next call.
  const Image& draw(std::size_t moment);
  int width() const { return image_.width; }  // pixels
  int height() const { return image_.height; }

 private:
  struct Scenes {
    std::unique_ptr<Scenery> whole;  // without panels
    std::vector<std::unique_ptr<Scenery>> panels;
  };

  PanelGrid grid_;
  Look own_;  // of one panel
  std::shared_ptr<const Scenes> scenes_;
  Raster raster_;  // of a panel
  Image image_;    // of all panels; without any only its size
};

}  // namespace sim
