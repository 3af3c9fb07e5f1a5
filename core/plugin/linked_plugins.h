// Plugins that are linked into a program, instead of being opened as libraries.
#pragma once

#include <span>

namespace sim {

struct PluginCard;
class Registrar;

// The two exports of a plugin's library, as symbols of the program.
struct LinkedPlugin {
  const PluginCard* card;
  void (*enroll)(Registrar& registrar);
};

// The list of plugins that sim_link_plugin() of CMake links into the program or library that calls
// this; CMake writes it.
std::span<const LinkedPlugin> linked_plugins();

}  // namespace sim
