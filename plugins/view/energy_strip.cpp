#include "plugins/view/energy_strip.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/base/text.h"

std::optional<double> energy_strip(std::span<const sim::EnergySample> past, double now, float width,
                                   float top) {
  constexpr float kLeft = 62, kRight = 84, kMargin = 12;
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({0, top});
  ImGui::SetNextWindowSize({width, size.y - top});
  ImGui::Begin("energies", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoBringToFrontOnFocus);
  ImDrawList& list = *ImGui::GetWindowDrawList();
  double low = 0, high = 0;
  for (const sim::EnergySample& each : past)
    for (const double e : {each.kinetic, each.potential, each.kinetic + each.potential})
      if (std::isfinite(e)) low = std::min(low, e), high = std::max(high, e);
  const double first = past.front().t, last = std::max(past.back().t, first + 1e-9);
  const auto x = [&](double t) {
    return kLeft + (width - kRight - kLeft) * static_cast<float>((t - first) / (last - first));
  };
  const auto y = [&](double e) {
    const double share = high > low ? (e - low) / (high - low) : 0;
    return size.y - kMargin - (size.y - top - 2 * kMargin) * static_cast<float>(share);
  };
  for (const double e : {low, 0.0, high}) {
    list.AddLine({kLeft, y(e)}, {width - kRight, y(e)}, tint(0xDFE3E8));
    const std::string text = e == 0 ? "0" : sim::brief(e, 3) + " J";
    list.AddText({kLeft - 6 - ImGui::CalcTextSize(text.c_str()).x, y(e) - 7}, tint(0x6B747E),
                 text.c_str());
  }
  struct Curve {
    const char* name;
    unsigned rgb;
    double (*of)(const sim::EnergySample&);
  };
  const Curve curves[] = {
      {"kinetic", 0x2458C8, [](const sim::EnergySample& s) { return s.kinetic; }},
      {"potential", 0x2E9E54, [](const sim::EnergySample& s) { return s.potential; }},
      {"total", 0xC23A4A, [](const sim::EnergySample& s) { return s.kinetic + s.potential; }}};
  float label = top;
  for (const Curve& curve : curves) {
    std::vector<ImVec2> points;
    for (const sim::EnergySample& each : past)
      if (std::isfinite(curve.of(each))) points.push_back({x(each.t), y(curve.of(each))});
    list.AddPolyline(points.data(), static_cast<int>(points.size()), tint(curve.rgb), 0, 1.6F);
    list.AddText({width - kRight + 8, label += 20}, tint(curve.rgb), curve.name);
  }
  list.AddLine({x(now), top + 4}, {x(now), size.y - 4}, tint(0x2B323A));
  ImGui::SetCursorScreenPos({kLeft, top});
  ImGui::InvisibleButton("time", {width - kLeft - kRight, size.y - top});
  std::optional<double> pressed;
  if (ImGui::IsItemActive() && (ImGui::IsItemActivated() || ImGui::GetIO().MouseDelta.x != 0)) {
    const double share = (ImGui::GetIO().MousePos.x - kLeft) / (width - kRight - kLeft);
    pressed = std::max(0.0, first + std::clamp(share, 0.0, 1.0) * (last - first));
  }
  ImGui::End();
  return pressed;
}
