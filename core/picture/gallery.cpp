#include "core/picture/gallery.h"

#include <algorithm>

namespace sim {
namespace {

constexpr int kGap = 2;                  // pixels between two panels
constexpr std::uint8_t kBetween = 0xFF;  // grey level there
constexpr int kLeastPixels = 16;         // a side of a panel

int part_of(int pixels, int count) {
  return std::max(kLeastPixels, (pixels - (count - 1) * kGap) / count);
}

Look look_of_panel(Look look, PanelGrid grid) {
  look.width = part_of(look.width, grid.columns);
  look.height = part_of(look.height, grid.rows);
  return look;
}

}  // namespace

PanelGrid panel_grid(int panels) {
  if (panels <= 3) return {std::max(1, panels), 1};
  PanelGrid grid;
  while (grid.columns * grid.columns < panels) ++grid.columns;
  grid.rows = (panels + grid.columns - 1) / grid.columns;
  return grid;
}

Gallery::Gallery(std::span<const Model> models, const Moments& moments, const Look& look,
                 const Panels& panels)
    : grid_(panels.any() ? panel_grid(static_cast<int>(models.size())) : PanelGrid{}),
      own_(look_of_panel(look, grid_)),
      raster_(own_.width, own_.height) {
  auto scenes = std::make_shared<Scenes>();
  image_.width = own_.width, image_.height = own_.height;
  if (!panels.any()) {
    scenes->whole = std::make_unique<Scenery>(models, moments, look);
    scenes_ = std::move(scenes);
    return;
  }
  const Viewpoint viewpoint = make_viewpoint(models.first(1), panels.stage, own_);
  const ColourScale scale = colour_scale(look, models, moments);
  for (std::size_t i = 0; i < models.size(); ++i) {
    auto panel = std::make_unique<Scenery>(models.subspan(i, 1), moments.of_system(i), own_);
    panel->set_viewpoint(viewpoint);
    panel->set_scale(scale);
    panel->set_caption(panels.captions[i]);
    scenes->panels.push_back(std::move(panel));
  }
  scenes_ = std::move(scenes);
  image_.width = grid_.columns * own_.width + (grid_.columns - 1) * kGap;
  image_.height = grid_.rows * own_.height + (grid_.rows - 1) * kGap;
  image_.width &= ~1, image_.height &= ~1;  // even, as films want
  image_.rgb.resize(3 * static_cast<std::size_t>(image_.width) *
                    static_cast<std::size_t>(image_.height));
}

Gallery::Gallery(const Gallery& other)
    : grid_(other.grid_),
      own_(other.own_),
      scenes_(other.scenes_),
      raster_(own_.width, own_.height),
      image_(other.image_) {}

void Gallery::stop_when(std::function<bool()> stop) { raster_.stop_when(std::move(stop)); }

const Image& Gallery::draw(std::size_t moment) {
  if (scenes_->whole) return raster_.draw(scenes_->whole->picture(moment));
  std::ranges::fill(image_.rgb, kBetween);
  for (std::size_t i = 0; i < scenes_->panels.size(); ++i) {
    const Image& panel = raster_.draw(scenes_->panels[i]->picture(moment));
    const int column = static_cast<int>(i) % grid_.columns,
              row = static_cast<int>(i) / grid_.columns;
    const int left = column * (panel.width + kGap), top = row * (panel.height + kGap);
    const int width = std::min(panel.width, image_.width - left);
    for (int y = 0; y < panel.height && top + y < image_.height; ++y)
      std::copy_n(panel.pixel(0, y), 3 * width,
                  image_.rgb.data() + 3 * (static_cast<std::size_t>(top + y) *
                                               static_cast<std::size_t>(image_.width) +
                                           static_cast<std::size_t>(left)));
  }
  return image_;
}

}  // namespace sim
