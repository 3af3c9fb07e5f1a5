// The energies of a live scene over time, below its picture, by Dear ImGui.
#pragma once

#include <imgui.h>

#include <optional>
#include <span>

#include "core/output/view.h"

// A colour of ImGui from 0xRRGGBB.
inline ImU32 tint(unsigned rgb, float opacity = 1) {
  return IM_COL32(rgb >> 16 & 255U, rgb >> 8 & 255U, rgb & 255U, static_cast<int>(255 * opacity));
}

// From `top` to the bottom, so wide, in points; `now` is marked. The time that is pressed, in s.
std::optional<double> energy_strip(std::span<const sim::EnergySample> past, double now, float width,
                                   float top);
