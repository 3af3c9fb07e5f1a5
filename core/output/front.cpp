#include "core/output/front.h"

#include <algorithm>
#include <cmath>

#include "core/base/text.h"
#include "core/picture/quantity.h"

namespace sim {
namespace {

using raster::cross;
using raster::dot;
using raster::unit;

constexpr float kSteepest = 1.5F;  // radians

std::string wide(const Vec3& x) {
  return shortest(x[0]) + " " + shortest(x[1]) + " " + shortest(x[2]);
}

}  // namespace

const std::vector<FrontKey>& Front::keys() {
  static const std::vector<FrontKey> kKeys{{"drag", "pull a particle; elsewhere: turn"},
                                           {"Shift+drag", "pull, and pin there"},
                                           {"Ctrl+click", "pin, unpin"},
                                           {"right drag", "move"},
                                           {"wheel + -", "zoom"},
                                           {"double click", "look at it"},
                                           {"Space", "play or pause"},
                                           {"R", "reset"},
                                           {"Left Right", "a step back, a step on"},
                                           {"U", "undo the last thing a hand did"},
                                           {"W", "wind, or the first switch"},
                                           {"F", "surface, wireframe, both"},
                                           {"S", "smooth or flat"},
                                           {"P", "springs of the picked particle"},
                                           {"C", "colours"},
                                           {"1 .. 9", "a system, seen or not"},
                                           {"[ ]", "half, twice the step"},
                                           {"Home Esc", "the first camera; let go"},
                                           {"Q", "quit"}};
  return kKeys;
}

Front::Front(const ViewScene& scene, float reach) : scene_(scene), reach_(reach) {
  look_ = scene.look;
  begin_scene();
  const V3& forward = base_.eye.forward;
  distance_ = std::max(0.05F, -dot(base_.eye.at, forward));
  at_ = base_.eye.at + distance_ * forward;
  const Ground basis = base_.ground.value_or(Ground{});
  pitch_ = std::asin(std::clamp(-dot(forward, basis.up), -1.0F, 1.0F));
  yaw_ = std::atan2(-dot(forward, basis.u), -dot(forward, basis.w));
}

void Front::renew(const ViewScene& scene) {
  scene_ = scene;
  held_ = picked_ = {};
  moment_.clear();
  begin_scene();
}

void Front::begin_scene() {
  base_ = make_viewpoint(scene_.models, scene_.preview, scene_.look);
  hidden_.assign(scene_.models.size(), false);
  scenery_.reset();
}

void Front::resize(int width, int height) {
  if (look_.width == width && look_.height == height) return;
  look_.width = width;
  look_.height = height;
  scenery_.reset();
}

void Front::show(const Moment& moment, const ViewState& state) {
  moment_ = moment;
  state_ = state;
  state_.past = {};
}

std::optional<int> Front::picked() const {
  return picked_ ? std::optional<int>(picked_->particle) : std::nullopt;
}

std::string Front::name(std::size_t system) const {
  return scene_.world ? scene_.models[system].name + ": " : "";
}

// --- The eye ------------------------------------------------------------------------------------

void Front::turn() {
  const Ground basis = base_.ground.value_or(Ground{});
  const float c = std::cos(pitch_), s = std::sin(pitch_);
  const V3 towards = c * std::sin(yaw_) * basis.u + s * basis.up + c * std::cos(yaw_) * basis.w;
  view_ = base_;
  view_.eye.at = at_ + distance_ * towards;
  view_.eye.forward = -towards;
  view_.eye.right = unit(cross(view_.eye.forward, basis.up));
  view_.eye.up = cross(view_.eye.right, view_.eye.forward);
}

V3 Front::place(std::size_t system, int particle) const {
  return view_.point(moment_[system].at(particle) + view_.offsets[system]);
}

// The ray of a pixel, with length 1 along the eye's forward.
V3 Front::ray(float x, float y) const {
  const auto width = static_cast<float>(look_.width), height = static_cast<float>(look_.height);
  const float scale = 2 / height / view_.eye.focal;
  return view_.eye.forward + (x - width / 2) * scale * view_.eye.right +
         (height / 2 - y) * scale * view_.eye.up;
}

V3 Front::pixel(std::size_t system, int particle) const {
  const V3 d = place(system, particle) - view_.eye.at;
  const float z = dot(d, view_.eye.forward);
  const float scale = view_.eye.focal * static_cast<float>(look_.height) / 2 / z;
  return {static_cast<float>(look_.width) / 2 + dot(d, view_.eye.right) * scale,
          static_cast<float>(look_.height) / 2 - dot(d, view_.eye.up) * scale, z};
}

// The nearest on the screen, those in front first.
std::optional<Front::Spot> Front::beside(float x, float y) const {
  constexpr float kDeep = 40;  // pixels that a unit of depth counts
  std::optional<Spot> best;
  float least = HUGE_VALF;
  for (std::size_t m = 0; m < moment_.size(); ++m)
    for (int i = 0; i < scene_.models[m].particles && !hidden_[m]; ++i) {
      const V3 p = pixel(m, i);
      const float off = std::hypot(p.x - x, p.y - y);
      if (!(p.z > 0) || !(off < reach_) || !(off + kDeep * p.z < least)) continue;
      least = off + kDeep * p.z;
      best = Spot{m, i, p.z};
    }
  return best;
}

// The first triangle's nearest corner, by Moller and Trumbore (1997), or a ball close to the ray,
// or else a particle beside it: at an edge no ray hits for sure.
std::optional<Front::Spot> Front::under(float x, float y) const {
  constexpr float kBall = 0.02F, kBefore = 0.1F;
  std::optional<Spot> best;
  const V3 d = ray(x, y), o = view_.eye.at;
  const auto nearer = [&](float z) { return z > 0 && (!best || z < best->depth); };
  for (std::size_t m = 0; m < moment_.size(); ++m) {
    if (hidden_[m]) continue;
    const Model& model = scene_.models[m];
    for (const auto& t : model.triangles) {
      if (torn(moment_[m], t)) continue;
      const V3 a = place(m, t[0]), e = place(m, t[1]) - a, f = place(m, t[2]) - a, p = cross(d, f);
      const float det = dot(e, p);
      if (!(std::abs(det) > 1e-14F)) continue;
      const V3 s = o - a, q = cross(s, e);
      const float u = dot(s, p) / det, v = dot(d, q) / det, z = dot(f, q) / det;
      if (!(u >= 0 && v >= 0 && u + v <= 1) || !nearer(z)) continue;
      best = Spot{m, t[u + v < 0.5F || (u < 0.5F && v < 0.5F) ? 0 : u > v ? 1 : 2], z};
    }
    const std::vector<bool> covered = model.in_triangles();
    for (int i = 0; i < model.particles; ++i) {
      const bool pin = std::ranges::binary_search(state_.systems[m].pinned, i);
      if (covered[static_cast<std::size_t>(i)] && !pin) continue;
      const V3 r = place(m, i) - o;
      const float z = dot(r, d) / dot(d, d);
      if (raster::length(r - z * d) < kBall * z && nearer(z - kBefore))
        best = Spot{m, i, z - kBefore};
    }
  }
  return best ? best : beside(x, y);
}

// --- Hands --------------------------------------------------------------------------------------

// In the plane of the screen, through where it was taken.
std::string Front::pull(float x, float y) const {
  const V3 p = view_.eye.at + held_->depth * ray(x, y);
  const Vec3 to = Vec3(p.x, p.y, p.z) / view_.scale + view_.origin - view_.offsets[held_->system];
  return name(held_->system) + "pull " + std::to_string(held_->particle) + " " + wide(to);
}

std::vector<std::string> Front::take(const FrontEvent& event) {
  using What = FrontEvent::What;
  if (moment_.empty()) return {};
  if (event.what == What::kKey) return key(event.key);
  turn();
  const float dx = event.x - x_, dy = event.y - y_;
  x_ = event.x;
  y_ = event.y;
  const auto height = static_cast<float>(look_.height);
  switch (event.what) {
    case What::kPress: {
      const std::optional<Spot> spot = event.moves ? std::nullopt : under(event.x, event.y);
      turning_ = !spot && !event.moves;
      moving_ = event.moves;
      if (!spot) return {};
      picked_ = spot;
      const std::string id = std::to_string(spot->particle), whose = name(spot->system);
      const auto& pinned = state_.systems[spot->system].pinned;
      if (event.control)
        return {whose + (std::ranges::binary_search(pinned, spot->particle) ? "unpin " : "pin ") +
                id};
      held_ = spot;
      held_->depth = dot(place(spot->system, spot->particle) - view_.eye.at, view_.eye.forward);
      pinning_ = event.shift;
      return {whose + "grab " + id};
    }
    case What::kMove:
      if (held_) return {pull(event.x, event.y)};
      if (turning_) {
        yaw_ -= 4.5F * dx / height;
        pitch_ = std::clamp(pitch_ + 4.5F * dy / height, -kSteepest, kSteepest);
      } else if (moving_) {
        const float scale = 2 * distance_ / view_.eye.focal / height;
        at_ = at_ - dx * scale * view_.eye.right + dy * scale * view_.eye.up;
      }
      return {};
    case What::kRelease: {
      turning_ = moving_ = false;
      if (!held_) return {};
      const std::string id = std::to_string(held_->particle), whose = name(held_->system);
      held_ = {};
      if (pinning_) return {whose + "pin " + id, whose + "release " + id};
      return {whose + "release " + id};
    }
    case What::kLook:
      if (const auto spot = under(event.x, event.y)) at_ = place(spot->system, spot->particle);
      return {};
    case What::kKey:
      return {};
  }
  return {};
}

std::vector<std::string> Front::switched() const {
  std::vector<std::string> words;
  for (std::size_t i = 0; i < state_.systems.size(); ++i) {
    const auto& switches = state_.systems[i].switches;
    if (switches.empty()) continue;
    const auto wind = std::ranges::find(switches, "wind", &std::pair<std::string, bool>::first);
    const auto& [chosen, on] = wind == switches.end() ? switches.front() : *wind;
    words.push_back(name(i) + "switch " + chosen + (on ? " off" : " on"));
  }
  return words;
}

// The next colour that somebody has; energies, errors and modes have to be asked for.
void Front::colour_on(std::vector<std::string>& words) {
  const std::vector<std::string>& all = Look::colours();
  auto at = std::ranges::find(all, look_.colour);
  for (std::size_t tries = 0; tries < all.size(); ++tries) {
    at = at == all.end() || at + 1 == all.end() ? all.begin() : at + 1;
    const auto has = [&](std::size_t m) {
      return !quantity(scene_.models[m], moment_[m], *at).empty();
    };
    bool any = *at == "none" || *at == "error" || *at == "mode";
    for (std::size_t m = 0; m < moment_.size(); ++m) any = any || has(m);
    if (!any) continue;
    look_.colour = *at;
    words.push_back("colour " + *at);
    return;
  }
}

std::vector<std::string> Front::key(std::string key) {
  std::vector<std::string> words;
  if (key.size() == 1) key[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(key[0])));
  if (key == "r" || key == "u") held_ = {};
  if (key == "q") closed_ = true;
  if (key == "Space") words = {state_.playing ? "pause" : "play"};
  if (key == "r") words = {"reset"};
  if (key == "Left") words = {"back 1"};
  if (key == "Right") words = {"step 1"};
  if (key == "u") words = {"undo"};
  if (key == "w") words = switched();
  if (key == "f") wire_ = (wire_ + 1) % 3, scenery_.reset();
  if (key == "s") flat_ = !flat_;
  if (key == "p") springs_ = !springs_;
  if (key == "c") colour_on(words);
  if (key == "?" || key == "h") help_ = !help_;
  if (key == "Esc") picked_ = {};
  if (key == "+" || key == "=") zoom(0.9F);
  if (key == "-") zoom(1 / 0.9F);
  if (key == "[" || key == "]")
    words = {name(chosen()) + "dt " +
             shortest(state_.systems[chosen()].h * (key == "[" ? 0.5 : 2))};
  if (key == "Home") {
    const Front first(scene_, reach_);
    yaw_ = first.yaw_, pitch_ = first.pitch_, distance_ = first.distance_, at_ = first.at_;
  }
  if (key.size() == 1 && key[0] >= '1' && key[0] <= '9' && hidden_.size() > 1) {
    const auto system = static_cast<std::size_t>(key[0] - '1');
    if (system < hidden_.size()) hidden_[system] = !hidden_[system], scenery_.reset();
  }
  return words;
}

// --- The picture --------------------------------------------------------------------------------

std::string Front::colour_now() const {
  const bool asked = look_.colour == "error" || look_.colour == "mode";
  if (asked && state_.measured != look_.colour) return "none";
  for (std::size_t m = 0; m < models_.size(); ++m)
    if (!quantity(models_[m], now_[0][m], look_.colour).empty()) return look_.colour;
  return "none";
}

// Each triangle of a surface has corners and a normal of its own.
void Front::flatten(Picture& picture) const {
  for (PictureTriangle& t : picture.triangles) {
    if (t.skin != 0) continue;
    V3 corner[3];
    for (std::size_t k = 0; k < 3; ++k)
      corner[k] = picture.points[static_cast<std::size_t>(t.points[k])];
    const V3 normal = unit(cross(corner[1] - corner[0], corner[2] - corner[0]));
    for (std::size_t k = 0; k < 3; ++k) {
      if (!picture.colours.empty())
        picture.colours.push_back(picture.colours[static_cast<std::size_t>(t.points[k])]);
      picture.normals.push_back(normal);
      t.points[k] = static_cast<int>(picture.points.size());
      picture.points.push_back(corner[k]);
    }
  }
}

Picture Front::picture() {
  turn();
  if (!scenery_) models_.clear();
  now_.assign(1, {});
  std::size_t k = 0;
  Viewpoint view = view_;
  view.offsets.clear();
  for (std::size_t m = 0; m < moment_.size(); ++m) {
    if (hidden_[m]) continue;
    if (!scenery_) models_.push_back(scene_.models[m]);
    models_[k].pinned = state_.systems[m].pinned;
    models_[k].method = state_.systems[m].method;
    models_[k++].h = state_.systems[m].h;
    view.offsets.push_back(view_.offsets[m]);
    now_[0].push_back(moment_[m]);
  }
  if (models_.empty()) {
    Picture empty;
    empty.eye = view.eye;
    empty.ground = view.ground;
    return empty;
  }
  Look look = look_;
  look.colour = colour_now();
  look.wireframe = wire_ > 0;
  if (springs_ && picked_ && !hidden_[picked_->system] &&
      !scene_.models[picked_->system].families.empty())
    look.picked = {picked_->particle};
  if (!scenery_ || shown_colour_ != look.colour) {
    if (shown_colour_ != look.colour) most_ = 0;
    scenery_ = std::make_unique<Scenery>(models_, now_, look);
    shown_colour_ = look.colour;
  }
  scenery_->set_picked(look.picked);
  scenery_->set_viewpoint(view);
  ColourScale scale = colour_scale(look, models_, now_);
  scale.most = most_ = steady_most(scale.most, most_);
  scenery_->set_scale(scale);
  Picture picture = scenery_->picture(0);
  if (flat_) flatten(picture);
  if (wire_ == 2)
    for (PictureTriangle& t : picture.triangles) t.visible = true;
  return picture;
}

}  // namespace sim
