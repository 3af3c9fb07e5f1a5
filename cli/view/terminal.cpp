#include "cli/view/terminal.h"

#include <algorithm>
#include <cmath>

#include "core/base/text.h"

namespace sim::cli {
namespace {

constexpr std::uint64_t kHere = 0;  // who speaks, among those who hold something
constexpr int kWords = 2;           // rows of words under the picture

struct Help {
  const char *keys, *does;
};
constexpr Help kHelp[] = {{"drag", "pull a particle; elsewhere: turn"},
                          {"right drag", "pull, and pin there"},
                          {"Ctrl+click", "pin, unpin"},
                          {"wheel + -", "zoom"},
                          {"Space", "play or pause"},
                          {"R", "reset"},
                          {"Left Right", "a step back, a step on"},
                          {"U", "undo the last thing a hand did"},
                          {"W", "wind, or the first switch"},
                          {"F", "wireframe"},
                          {"P", "springs of the picked particle"},
                          {"C", "colours: plain, strain, speed"},
                          {"[ ]", "half, twice the step"},
                          {"Q", "quit"}};

V3 unit_of(const V3& v) {
  const float length = std::sqrt(dot(v, v));
  return length > 0 ? (1 / length) * v : v;
}

std::string cut(std::string text, int width) {
  std::ranges::replace_if(
      text, [](char c) { return static_cast<unsigned char>(c) < 32; }, ' ');
  if (text.size() >= static_cast<std::size_t>(width))
    text.resize(static_cast<std::size_t>(std::max(1, width) - 1));
  return text;
}

}  // namespace

TerminalFront::TerminalFront(Live& live) : live_(live) {
  base_ = make_viewpoint(live.models(), live.preview(), look_);
  const V3& forward = base_.eye.forward;
  const float away = std::max(0.05F, -dot(base_.eye.at, forward));
  distance_ = away;
  at_ = base_.eye.at + away * forward;
  const Ground basis = base_.ground ? *base_.ground : Ground{};
  pitch_ = std::asin(std::clamp(-dot(forward, basis.up), -1.0F, 1.0F));
  yaw_ = std::atan2(-dot(forward, basis.u), -dot(forward, basis.w));
}

void TerminalFront::turn(Viewpoint& view) const {
  const Ground basis = view.ground ? *view.ground : Ground{};
  const auto c = static_cast<float>(std::cos(pitch_)), s = static_cast<float>(std::sin(pitch_));
  const auto cy = static_cast<float>(std::cos(yaw_)), sy = static_cast<float>(std::sin(yaw_));
  const V3 towards = c * sy * basis.u + s * basis.up + c * cy * basis.w;
  view.eye.at = at_ + static_cast<float>(distance_) * towards;
  view.eye.forward = -1 * towards;
  view.eye.right = unit_of(cross(view.eye.forward, basis.up));
  view.eye.up = cross(view.eye.right, view.eye.forward);
}

std::string TerminalFront::name(std::size_t system) const {
  return live_.world() ? live_.player().system(system).name() + ": " : "";
}

void TerminalFront::say(const std::string& line) { said_ = live_.take(kHere, line); }

// The particle nearest to a cell, of those in front; within two cells.
TerminalFront::Spot TerminalFront::under(int x, int y) const {
  constexpr float kReach = 4;  // pixels
  Spot best;
  float least = 1e9F;
  const auto width = static_cast<float>(size_.columns);
  const auto height = static_cast<float>(2 * (size_.rows - kWords));
  for (std::size_t m = 0; m < moment_.size(); ++m)
    for (int i = 0; i < live_.models()[m].particles; ++i) {
      const V3 d = view_.point(moment_[m].at(i) + view_.offsets[m]) - view_.eye.at;
      const float z = dot(d, view_.eye.forward);
      if (z <= 0) continue;
      const float scale = view_.eye.focal * height / 2 / z;
      const float dx = width / 2 + dot(d, view_.eye.right) * scale - static_cast<float>(x) - 0.5F;
      const float dy = height / 2 - dot(d, view_.eye.up) * scale - 2 * static_cast<float>(y) - 1;
      const float off = std::sqrt(dx * dx + dy * dy);
      if (off > kReach || off + 4 * z > least) continue;
      least = off + 4 * z;
      best = {m, i};
    }
  return best;
}

// In the plane of the screen, through where it was taken.
void TerminalFront::pull(int x, int y) {
  const auto width = static_cast<float>(size_.columns);
  const auto height = static_cast<float>(2 * (size_.rows - kWords));
  const float scale = view_.eye.focal * height / 2 / depth_;
  const V3 p = view_.eye.at + depth_ * view_.eye.forward +
               (static_cast<float>(x) + 0.5F - width / 2) / scale * view_.eye.right +
               (height / 2 - 2 * static_cast<float>(y) - 1) / scale * view_.eye.up;
  const Vec3 place = Vec3(p.x, p.y, p.z) / view_.scale + view_.origin - view_.offsets[held_.system];
  live_.pull(held_.system, held_.particle, place);
}

void TerminalFront::take(const TerminalEvent& event) {
  using What = TerminalEvent::What;
  const int dx = event.x - x_, dy = event.y - y_;
  if (event.what != What::kKey) x_ = event.x, y_ = event.y;
  switch (event.what) {
    case What::kKey:
      return key(event.key);
    case What::kWheel:
      distance_ *= event.button == 0 ? 0.9 : 1.1;
      return;
    case What::kPress: {
      const Spot spot = under(event.x, event.y);
      if (spot.particle < 0) {
        turning_ = true;
        return;
      }
      picked_ = spot;
      const std::string id = std::to_string(spot.particle);
      if (event.control) {
        const bool pinned = live_.player().system(spot.system).pinned(spot.particle);
        return say(name(spot.system) + (pinned ? "unpin " : "pin ") + id);
      }
      held_ = spot;
      pinning_ = event.shift || event.button == 2;
      const V3 d =
          view_.point(moment_[spot.system].at(spot.particle) + view_.offsets[spot.system]) -
          view_.eye.at;
      depth_ = dot(d, view_.eye.forward);
      return say(name(spot.system) + "grab " + id);
    }
    case What::kMove:
      if (held_.particle >= 0) return pull(event.x, event.y);
      if (!turning_) return;
      yaw_ -= 0.05 * dx;
      pitch_ = std::clamp(pitch_ + 0.1 * dy, -1.5, 1.5);
      return;
    case What::kRelease:
      turning_ = false;
      if (held_.particle < 0) return;
      const std::string id = std::to_string(held_.particle);
      if (pinning_) say(name(held_.system) + "pin " + id);
      say(name(held_.system) + "release " + id);
      held_ = {};
  }
}

void TerminalFront::key(const std::string& pressed) {
  std::string key = pressed;
  if (key.size() == 1) key[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(key[0])));
  Simulation& system = live_.player().system(picked_.system);
  said_.clear();
  if (key == "q") closed_ = true;
  if (key == "Space") say(live_.playing() ? "pause" : "play");
  if (key == "r") held_ = {}, say("reset");
  if (key == "Left") say("back 1");
  if (key == "Right") say("step 1");
  if (key == "u") held_ = {}, say("undo");
  if (key == "f") look_.wireframe = !look_.wireframe;
  if (key == "?" || key == "h") help_ = !help_, cells_.forget();
  if (key == "Esc") picked_ = {}, look_.picked.clear();
  if (key == "p")
    look_.picked = look_.picked.empty() && picked_.particle >= 0
                       ? std::vector<int>{picked_.particle}
                       : std::vector<int>{};
  if (key == "c")
    look_.colour = look_.colour == "none" ? "strain" : look_.colour == "strain" ? "speed" : "none";
  if (key == "+" || key == "=") distance_ *= 0.9;
  if (key == "-") distance_ *= 1.1;
  if (key == "[" || key == "]")
    say(name(picked_.system) + "dt " + shortest(system.h() * (key == "[" ? 0.5 : 2)));
  if (key != "w") return;
  for (std::size_t i = 0; i < live_.player().count(); ++i) {
    const auto switches = live_.player().system(i).switches();
    if (switches.empty()) continue;
    const auto wind = std::ranges::find(switches, "wind", &std::pair<std::string, bool>::first);
    const auto& [chosen, on] = wind == switches.end() ? switches.front() : *wind;
    say(name(i) + "switch " + chosen + (on ? " off" : " on"));
  }
}

std::string TerminalFront::status() const {
  Simulation& system = live_.player().system(picked_.system);
  std::string text = "t = " + brief(system.t(), 4) + " s  " + system.method().name() + " " +
                     brief(1e3 * system.h(), 3) + " ms";
  if (const double share = live_.share(picked_.system); !std::isnan(share))
    text += " = " + brief(100 * share, 2) + " % of limit";
  text += live_.playing() ? "  " + brief(live_.real(), 2) + " x real time" : "  paused";
  if (picked_.particle >= 0) text += "  particle " + std::to_string(picked_.particle);
  return text + "  ? keys";
}

std::string TerminalFront::picture() {
  const CellSize now = terminal_size();
  if (!raster_ || now.columns != size_.columns || now.rows != size_.rows) {
    size_ = {std::min(now.columns, 240), std::min(now.rows, 80)};
    look_.width = size_.columns;
    look_.height = 2 * (size_.rows - kWords);
    raster_ = std::make_unique<Raster>(look_.width, look_.height);
    cells_.forget();
    size_ = now.columns <= 240 && now.rows <= 80 ? now : size_;
  }
  moment_ = live_.moment();
  Scenery scenery(live_.models(), {&moment_, 1}, look_);
  view_ = base_;
  turn(view_);
  scenery.set_viewpoint(view_);
  Picture picture = scenery.picture(0);
  picture.texts.clear();
  picture.patches.clear();
  std::string out = "\x1b[?2026h" + cells_.changes(raster_->draw(picture));
  const auto row = [&](int y, const std::string& text) {
    out += "\x1b[" + std::to_string(y) + ";1H" + cut(text, size_.columns) + "\x1b[K";
  };
  if (help_) {
    int y = 1;
    for (const auto& [keys, does] : kHelp)
      out += "\x1b[" + std::to_string(++y) + ";3H " +
             cut(std::string(keys) + std::string(12 - std::string_view(keys).size(), ' ') + does,
                 size_.columns - 4) +
             " ";
    cells_.forget();
  }
  row(size_.rows - 1, status());
  row(size_.rows, said_.empty() ? live_.verdict(picked_.system) : said_);
  return out + "\x1b[?2026l";
}

}  // namespace sim::cli
