#include "core/picture/quantity.h"

#include <algorithm>
#include <cmath>

#include "core/picture/raster/tone.h"

namespace sim {
namespace {

using Ramp = std::span<const unsigned>;
// From dark blue over green to yellow; from sand over orange to a deep red; blue, white, red.
constexpr unsigned kRising[] = {0x2C3570, 0x2A6A94, 0x2F9C8C, 0x86C36B, 0xF3DE6A};
constexpr unsigned kAlarm[] = {0xEDE7DA, 0xF3C47A, 0xE88444, 0xC63A2D, 0x6E0F25};
constexpr unsigned kSigned[] = {0x1F4E9E, 0x7FA8D8, 0xF0EEEA, 0xE58A6B, 0xA81E2B};

Ramp ramp_of(const ColourScale& scale) {
  if (scale.both_signs) return kSigned;
  return scale.name == "error" ? Ramp(kAlarm) : Ramp(kRising);
}

}  // namespace

double round_up(double value) {
  if (!(value > 0) || !std::isfinite(value)) return 1;
  double power = 1;
  while (power > value) power /= 10;
  while (10 * power <= value) power *= 10;
  for (const double step : {1.0, 2.0, 3.0, 5.0})
    if (step * power >= value * (1 - 1e-9)) return step * power;
  return 10 * power;
}

unsigned ColourScale::screen(double s) const {
  const Ramp ramp = ramp_of(*this);
  const double place = std::clamp(s, 0.0, 1.0) * static_cast<double>(ramp.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(place), ramp.size() - 2);
  const double part = place - static_cast<double>(i);
  unsigned rgb = 0;
  for (const int shift : {16, 8, 0}) {
    const double a = (ramp[i] >> shift) & 255U, b = (ramp[i + 1] >> shift) & 255U;
    rgb |= static_cast<unsigned>(std::lround(a + part * (b - a))) << shift;
  }
  return rgb;
}

V3 ColourScale::colour(double value) const {
  if (!std::isfinite(value)) return sim::colour(0x808080);
  return sim::colour(screen(both_signs ? 0.5 + 0.5 * value / most : value / most));
}

std::vector<double> quantity(const Model& model, const Frame& frame, const std::string& name) {
  const auto n = static_cast<std::size_t>(model.particles);
  std::vector<double> values;
  if (const auto at = std::ranges::find(model.names, name);
      at != model.names.end() && !model.curves()) {
    for (auto i = static_cast<std::size_t>(at - model.names.begin()); i < frame.components.size();
         i += model.names.size())
      values.push_back(frame.components[i]);
  } else if (name == "speed" && !frame.v.empty()) {
    for (std::size_t i = 0; i < n; ++i)
      values.push_back(Vec3(frame.v[3 * i], frame.v[3 * i + 1], frame.v[3 * i + 2]).norm());
  } else if (name == "strain" && !model.families.empty()) {
    values.resize(n);
    for (std::size_t f = 0; f < model.families.size(); ++f)
      for (std::size_t s = 0; s < model.families[f].ends.size(); ++s) {
        const double value = strain(model, frame, static_cast<int>(f), s);
        for (const int i : model.families[f].ends[s]) {
          double& held = values[static_cast<std::size_t>(i)];
          if (std::abs(value) > std::abs(held)) held = value;
        }
      }
  } else if (name == "energy" && !frame.v.empty()) {
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3 v(frame.v[3 * i], frame.v[3 * i + 1], frame.v[3 * i + 2]);
      values.push_back(0.5 * model.mass[i] * v.dot(v));
    }
    for (const ModelFamily& family : model.families)
      for (std::size_t s = 0; s < family.ends.size(); ++s) {
        const auto [a, b] = family.ends[s];
        if (torn(frame, a, b)) continue;
        const double length = (frame.at(b) - frame.at(a)).norm();
        const bool acts = !slack(family.sense[s], length, family.rest[s]);
        const double d = acts ? length - family.rest[s] : 0;
        for (const int i : {a, b})
          values[static_cast<std::size_t>(i)] += 0.25 * family.stiffness[s] * d * d;
      }
  } else if (name != "strain" && name != "speed" && frame.values.size() == n) {
    values = frame.values;
  }
  return values;
}

std::string colour_of(const Look& look, std::span<const Model> models) {
  if (look.colour == "none")
    for (const Model& model : models)
      if (model.lattice() && !model.curves()) return model.names.front();
  return look.colour;
}

ColourScale colour_scale(const Look& look, std::span<const Model> models, const Moments& moments) {
  ColourScale scale;
  scale.name = colour_of(look, models);
  if (look.colour == "strain") scale = {"strain", "%", 100, 1, true};
  if (look.colour == "speed") scale = {"speed", "m/s", 1, 1, false};
  if (look.colour == "energy") scale = {"energy", "J", 1, 1, false};
  if (look.colour == "error") scale = {"error", "m", 1, 1, false};
  if (look.colour == "mode") scale = {"fastest mode", "", 1, 1, false};
  double most = 0, least = 0;
  if (look.most > 0) {
    scale.most = look.most;
    return scale;
  }
  Moment room;
  for (std::size_t at = 0; at < moments.size(); ++at) {
    const Moment& moment = moments.at(at, room);
    for (std::size_t m = 0; m < models.size() && m < moment.size(); ++m)
      for (const double value : quantity(models[m], moment[m], scale.name))
        if (std::isfinite(value)) {
          most = std::max(most, std::abs(value));
          least = std::min(least, value);
        }
  }
  // Numbers of a lattice may have either sign.
  const bool known = std::ranges::count(Look::colours(), scale.name) > 0;
  if (!known && least < -1e-3 * most) scale.both_signs = true;
  scale.most = round_up(most);
  return scale;
}

}  // namespace sim
