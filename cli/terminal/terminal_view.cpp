#include "cli/terminal/terminal_view.h"

#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <optional>

#include "core/base/text.h"
#include "core/output/stream.h"
#include "core/picture/raster/raster.h"
#include "core/picture/scenery.h"

namespace sim::cli {
namespace {

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

bool many_colours() {
  const std::string colours = variable("COLORTERM");
  return colours == "truecolor" || colours == "24bit";
}

// The nearest of the 6 x 6 x 6 colours, or of the 24 greys.
int of_256(const std::uint8_t* rgb) {
  const int least = std::min({rgb[0], rgb[1], rgb[2]}), most = std::max({rgb[0], rgb[1], rgb[2]});
  if (most - least < 14) {
    const int grey = (rgb[0] + rgb[1] + rgb[2]) / 3;
    return grey < 4 ? 16 : grey > 246 ? 231 : 232 + std::clamp((grey - 3) / 10, 0, 23);
  }
  const auto step = [](int v) { return v < 48 ? 0 : v < 115 ? 1 : (v - 35) / 40; };
  return 16 + 36 * step(rgb[0]) + 6 * step(rgb[1]) + step(rgb[2]);
}

class TerminalView final : public Writer {
 public:
  explicit TerminalView(const WriterTask& task) : task_(task), exact_(many_colours()) {
    winsize size{};
    if (::ioctl(1, TIOCGWINSZ, &size) != 0 || size.ws_col < 20 || size.ws_row < 12)
      size.ws_col = 80, size.ws_row = 24;
    columns_ = std::min<int>(size.ws_col, 160);
    rows_ = std::clamp(columns_ * 9 / 32, 8, std::max(8, size.ws_row - 4));
    task_.look.width = columns_;
    task_.look.height = 2 * rows_;
    raster_ = std::make_unique<Raster>(columns_, 2 * rows_);
  }

  ~TerminalView() override {
    if (shown_) put(std::cout, "\x1b[?25h\x1b[0m");
  }

  Pace pace() const override { return Pace::kFilm; }

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

  // Until the clock is where the run is; a signal ends it.
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

  // Two pixels a cell: the upper one is the colour of the block, the lower one that behind it.
  void show(const Image& image, const Moment& moment) {
    std::string out = shown_ ? "\x1b[" + std::to_string(rows_ + 1) + "A" : "\x1b[?25l";
    for (int y = 0; y < rows_; ++y) {
      std::string before[2];
      for (int x = 0; x < columns_; ++x) {
        const std::string colours[2] = {colour_code(38, image.pixel(x, 2 * y)),
                                        colour_code(48, image.pixel(x, 2 * y + 1))};
        for (int i = 0; i < 2; ++i)
          if (colours[i] != before[i]) out += before[i] = colours[i];
        out += "\xe2\x96\x80";
      }
      out += "\x1b[0m\x1b[K\n";
    }
    std::string line = "t = " + brief(moment.front().t, 4) + " s";
    for (const Model& model : task_.models) line += "   " + model.name;
    if (line.size() >= static_cast<std::size_t>(columns_))
      line.resize(static_cast<std::size_t>(columns_) - 1);
    out += line + "\x1b[K\n";
    put(std::cout, out);
    shown_ = true;
  }

  std::string colour_code(int what, const std::uint8_t* rgb) const {
    std::string code = "\x1b[" + std::to_string(what);
    if (!exact_) return code + ";5;" + std::to_string(of_256(rgb)) + "m";
    code += ";2";
    for (int c = 0; c < 3; ++c) code += ";" + std::to_string(rgb[c]);
    return code + "m";
  }

  using Clock = std::chrono::steady_clock::duration;

  WriterTask task_;
  bool exact_, shown_ = false;
  int columns_ = 80, rows_ = 22;
  std::unique_ptr<Raster> raster_;
  std::vector<Moment> moments_;
  std::optional<Viewpoint> view_;
  std::chrono::steady_clock::time_point begin_;
};

}  // namespace

std::string cannot_show() {
  if (::isatty(1) == 0) return "standard output is no terminal";
  if (variable("TERM") == "dumb" || variable("TERM").empty()) return "the terminal has no colours";
  if (!variable("NO_COLOR").empty()) return "NO_COLOR is set";
  return "";
}

std::unique_ptr<Writer> make_terminal_view(const WriterTask& task) {
  return std::make_unique<TerminalView>(task);
}

}  // namespace sim::cli
