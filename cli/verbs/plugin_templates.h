// Source templates for a new plugin of each kind. NAME and CLASS stand for the user's names.
#pragma once

#include <span>

namespace sim::cli {

struct PluginTemplate {
  const char* kind;
  const char* source;  // NAME.cpp
  const char* scene;   // NAME.lua; null for a kind that no scene names
  const char* run = "sim NAME.lua";
};

std::span<const PluginTemplate> plugin_templates();

}  // namespace sim::cli
