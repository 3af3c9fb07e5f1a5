// Systems side by side: where their panels stand, and that each is drawn as it would be alone.
#include "core/picture/gallery.h"

#include <catch2/catch.hpp>

#include "tests/support/scenes.h"

namespace {

struct Seen {
  std::vector<sim::Model> models;
  std::vector<sim::Moment> moments{1};
};

// The same cloth after 10, 20, .. steps, as methods that part.
Seen cloths(int count) {
  sim::Registry registry = sim_test::make_registry();
  const sim::SystemSpec spec = sim_test::make_cloth(6);
  sim::Simulation system(spec, registry);
  Seen seen;
  for (int k = 0; k < count; ++k) {
    REQUIRE(sim_test::run(system, 10));
    seen.models.push_back(sim::make_model(spec, system));
    seen.moments[0].push_back(sim::take_frame(system));
  }
  return seen;
}

}  // namespace

TEST_CASE("so many panels have so many columns and rows") {
  const int sizes[][3] = {{0, 1, 1}, {1, 1, 1}, {2, 2, 1}, {3, 3, 1},  {4, 2, 2},  {5, 3, 2},
                          {6, 3, 2}, {7, 3, 3}, {9, 3, 3}, {10, 4, 3}, {12, 4, 3}, {13, 4, 4}};
  for (const auto& [panels, columns, rows] : sizes) {
    const sim::PanelGrid grid = sim::panel_grid(panels);
    INFO(panels);
    CHECK(grid.columns == columns);
    CHECK(grid.rows == rows);
  }
}

TEST_CASE("each panel is the picture of its system, two white pixels from the next") {
  sim::Look look;
  look.width = 201, look.height = 120;
  for (const int count : {1, 2, 4}) {
    const Seen seen = cloths(count);
    sim::Panels panels;
    panels.stage = {{seen.moments[0].back()}};
    for (int k = 0; k < count; ++k) panels.captions.push_back({"panel " + std::to_string(k)});
    sim::Gallery gallery(seen.models, seen.moments, look, panels);
    const int columns = count == 1 ? 1 : 2, rows = count == 4 ? 2 : 1;
    const int width = (201 - 2 * (columns - 1)) / columns, height = (120 - 2 * (rows - 1)) / rows;
    INFO(count << " panels of " << width << " x " << height);
    const sim::Image& all = gallery.draw(0);
    CHECK(all.width == (columns * width + 2 * (columns - 1)) / 2 * 2);
    CHECK(all.height == (rows * height + 2 * (rows - 1)) / 2 * 2);
    CHECK(gallery.width() == all.width);
    CHECK(gallery.height() == all.height);

    sim::Look own = look;
    own.width = width, own.height = height;
    sim::Raster raster(width, height);
    long different = 0;
    std::vector<bool> in_panel(static_cast<std::size_t>(all.width * all.height));
    for (int k = 0; k < count; ++k) {
      const auto at = static_cast<std::size_t>(k);
      const std::vector<sim::Moment> moments{{seen.moments[0][at]}};
      const std::span<const sim::Model> models = std::span(seen.models).subspan(at, 1);
      sim::Scenery scenery(models, moments, own);
      scenery.set_viewpoint(
          sim::make_viewpoint(std::span(seen.models).first(1), panels.stage, own));
      scenery.set_scale(sim::colour_scale(look, seen.models, seen.moments));
      scenery.set_caption(panels.captions[at]);
      const sim::Image& alone = raster.draw(scenery.picture(0));
      const int left = k % 2 * (width + 2), top = k / 2 * (height + 2);
      for (int y = 0; y < height && top + y < all.height; ++y)
        for (int x = 0; x < width && left + x < all.width; ++x) {
          in_panel[static_cast<std::size_t>((top + y) * all.width + left + x)] = true;
          for (int c = 0; c < 3; ++c)
            different += alone.pixel(x, y)[c] != all.pixel(left + x, top + y)[c];
        }
    }
    CHECK(different == 0);
    long dark = 0;
    for (int y = 0; y < all.height; ++y)
      for (int x = 0; x < all.width; ++x)
        if (!in_panel[static_cast<std::size_t>(y * all.width + x)])
          for (int c = 0; c < 3; ++c) dark += all.pixel(x, y)[c] != 0xFF;
    CHECK(dark == 0);
  }
}
