#include "cli/terminal/terminal_view.h"

#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <optional>

#include "cli/terminal/cells.h"
#include "cli/terminal/console.h"
#include "core/base/text.h"
#include "core/base/utf8.h"
#include "core/output/stream.h"
#include "core/picture/raster/raster.h"
#include "core/picture/scenery.h"

namespace sim::cli {
namespace {

class TerminalView final : public Writer {
 public:
  explicit TerminalView(const WriterTask& task) : task_(task) {
    const CellSize size = terminal_size();
    columns_ = std::min(size.columns, 160);
    rows_ = std::clamp(columns_ * 9 / 32, 8, std::max(8, size.rows - 4));
    task_.look.width = columns_;
    task_.look.height = 2 * rows_;
    raster_ = std::make_unique<Raster>(columns_, 2 * rows_);
  }

  ~TerminalView() override {
    if (shown_) put_control(std::cout, "\x1b[?25h\x1b[0m");
  }

  CostEstimate pace() const override { return CostEstimate::kFilm; }

  // The eye stays until something leaves the picture.
  void add(const Moment& moment) override {
    wait(moment.front().t);
    if (moments_.size() > 300) moments_.erase(moments_.begin() + 1);
    moments_.push_back(moment);
    Scenery scenery(task_.models, moments_, task_.look);
    if (view_) {
      const Viewpoint fitted = scenery.viewpoint();
      scenery.set_viewpoint(*view_);
      if (leaves(scenery.picture(moments_.size() - 1))) scenery.set_viewpoint(fitted);
    }
    view_ = scenery.viewpoint();
    Picture picture = scenery.picture(moments_.size() - 1);
    picture.texts.clear();  // too small to read
    show(raster_->draw(picture), moment);
  }

  void commit() override {}

 private:
  bool leaves(const Picture& picture) const {
    const auto outside = [&](const V3& p) {
      const V3 d = p - picture.eye.at;
      const float z = dot(d, picture.eye.forward);
      return !(std::abs(dot(d, picture.eye.up)) * picture.eye.focal < z) ||
             !(std::abs(dot(d, picture.eye.right)) * picture.eye.focal < z * 16 / 9);
    };
    return std::ranges::any_of(picture.points, outside) ||
           std::ranges::any_of(picture.balls,
                               [&](const PictureBall& b) { return outside(b.centre); });
  }

  // Waits until the clock reaches the run; a signal ends it.
  void wait(double t) {
    const auto now = std::chrono::steady_clock::now();
    if (!shown_) begin_ = now - std::chrono::duration_cast<Clock>(std::chrono::duration<double>(t));
    const double early =
        t - std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
    if (!(early > 0) || !(early < 60)) return;
    const timespec span{static_cast<time_t>(early),
                        static_cast<long>((early - std::floor(early)) * 1e9)};
    ::nanosleep(&span, nullptr);
  }

  void show(const Image& image, const Moment& moment) {
    std::string out = shown_ ? "\x1b[" + std::to_string(rows_ + 1) + "A" : "\x1b[?25l";
    for (int y = 0; y < rows_; ++y) out += cells_.row(image, y) + "\x1b[K\n";
    std::string line = "t = " + brief(moment.front().t, 4) + " s";
    for (const Model& model : task_.models) line += "   " + model.name;
    out += cut_columns(visible_line(line), static_cast<std::size_t>(columns_) - 1) + "\x1b[K\n";
    put_control(std::cout, out);
    std::cout.flush();
    shown_ = true;
  }

  using Clock = std::chrono::steady_clock::duration;

  WriterTask task_;
  Cells cells_;
  bool shown_ = false;
  int columns_ = 80, rows_ = 22;
  std::unique_ptr<Raster> raster_;
  std::vector<Moment> moments_;
  std::optional<Viewpoint> view_;
  std::chrono::steady_clock::time_point begin_;
};

}  // namespace

std::string cannot_show() { return no_pictures(); }

std::unique_ptr<Writer> make_terminal_view(const WriterTask& task) {
  return std::make_unique<TerminalView>(task);
}

}  // namespace sim::cli
