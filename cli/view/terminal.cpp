#include "cli/view/terminal.h"

#include <algorithm>
#include <cmath>

#include "core/base/text.h"
#include "core/base/utf8.h"

namespace sim::cli {
namespace {

constexpr std::uint64_t kHere = 0;  // who speaks, among those who hold something
constexpr int kWords = 2;           // rows of words under the picture
constexpr float kReach = 4;         // pixels, beside a particle
constexpr int kMostColumns = 240, kMostRows = 80;

std::string cut(std::string text, int width) {
  std::ranges::replace_if(
      text, [](char c) { return c == '\n' || c == '\t'; }, ' ');
  return cut_columns(visible_line(text), static_cast<std::size_t>(std::max(1, width) - 1));
}

}  // namespace

TerminalFront::TerminalFront(Live& live) : live_(live), front_(live.scene(), kReach) {}

// Terminals keep Shift to themselves: there the right button pins.
void TerminalFront::take(const TerminalEvent& event) {
  using What = TerminalEvent::What;
  if (event.what == What::kWheel) return front_.zoom(event.button == 0 ? 0.9F : 1 / 0.9F);
  FrontEvent one{.key = event.key};
  one.x = static_cast<float>(event.x) + 0.5F;
  one.y = static_cast<float>(2 * event.y) + 1;
  one.shift = event.shift || event.button == 2;
  one.control = event.control;
  one.what = event.what == What::kPress     ? FrontEvent::What::kPress
             : event.what == What::kMove    ? FrontEvent::What::kMove
             : event.what == What::kRelease ? FrontEvent::What::kRelease
                                            : FrontEvent::What::kKey;
  if (event.what == What::kKey) said_.clear();
  for (const std::string& words : front_.take(one)) said_ = live_.take(kHere, words);
}

std::string TerminalFront::status() const {
  const ViewSystem& system = state_.systems[front_.chosen()];
  std::string text = "t = " + brief(system.now.t, 4) + " s  " + system.method + " " +
                     brief(1e3 * system.h, 3) + " ms";
  if (!std::isnan(system.share)) text += " = " + brief(100 * system.share, 2) + " % of limit";
  text += state_.playing ? "  " + brief(state_.real, 2) + " x real time" : "  paused";
  if (const auto picked = front_.picked()) text += "  particle " + std::to_string(*picked);
  return text + "  ? keys";
}

std::string TerminalFront::picture() {
  CellSize now = terminal_size();
  now = {std::min(now.columns, kMostColumns), std::min(now.rows, kMostRows)};
  if (!raster_ || now.columns != size_.columns || now.rows != size_.rows) {
    size_ = now;
    const int width = size_.columns, height = 2 * (size_.rows - kWords);
    front_.resize(width, height);
    raster_ = std::make_unique<Raster>(width, height);
    cells_.forget();
  }
  state_ = live_.state();
  front_.show(live_.moment(), state_);
  Picture picture = front_.picture();
  picture.texts.clear();
  picture.patches.clear();
  if (front_.help() != help_) cells_.forget();
  help_ = front_.help();
  std::string out = "\x1b[?2026h" + cells_.changes(raster_->draw(picture));
  const auto row = [&](int y, const std::string& text) {
    out += "\x1b[" + std::to_string(y) + ";1H" + cut(text, size_.columns) + "\x1b[K";
  };
  if (help_) {
    int y = 1;
    for (const auto& [keys, does] : Front::keys()) {
      if (y + kWords >= size_.rows) break;
      out += "\x1b[" + std::to_string(++y) + ";3H " +
             cut(std::string(keys) + std::string(14 - std::string_view(keys).size(), ' ') + does,
                 size_.columns - 4) +
             " ";
    }
    cells_.forget();
  }
  row(size_.rows - 1, status());
  const std::string& verdict = state_.systems[front_.chosen()].verdict;
  row(size_.rows, !said_.empty() ? said_ : state_.failure.empty() ? verdict : state_.failure);
  return out + "\x1b[?2026l";
}

}  // namespace sim::cli
