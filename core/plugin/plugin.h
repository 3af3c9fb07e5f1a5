// The exports of a plugin library: a card of constant data, checked before any of its code runs,
// and one function that registers its plugins.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>
#include <utility>

#include "core/base/error.h"
#include "core/plugin/plugin_info.h"

namespace sim {

inline constexpr std::uint64_t kPluginMagic = 0x31676c50'6d6953;  // "SimPlg1"
inline constexpr std::uint32_t kPluginAbi = 40;

// Plain data in the section .sim_plugin of the library; no pointers, so that it can be read from
// the file. `names` holds "name/alias/alias name2 ...".
struct PluginCard {
  std::uint64_t magic;
  std::uint32_t abi;
  std::uint32_t kind;
  std::uint32_t sizes[6];
  char names[256];
  char build[128];
};

// Sizes of the structs that are exchanged between kernel and plugin.
inline constexpr std::uint32_t kAbiSizes[6] = {sizeof(ParticleView), sizeof(Tile),
                                               sizeof(PluginInfo),   sizeof(Param),
                                               sizeof(Stage),        sizeof(IntegratorInfo)};

template <class Object>
constexpr PluginCard make_card(std::string_view names) {
  PluginCard card{kPluginMagic, kPluginAbi, kind_of<Object>.number, {}, {}, {}};
  for (int i = 0; i < 6; ++i) card.sizes[i] = kAbiSizes[i];
  if (names.size() >= sizeof card.names) throw "too many plugin names for one library";
  for (std::size_t i = 0; i < names.size(); ++i) card.names[i] = names[i];
  constexpr std::string_view kBuild = __VERSION__;
  for (std::size_t i = 0; i < kBuild.size() && i + 1 < sizeof card.build; ++i)
    card.build[i] = kBuild[i];
  return card;
}

// The argument of the library's registration function.
class Registrar {
 public:
  template <class Object>  // of every kind
  void add(Plugin<Object> plugin) {
    plugin.kind = kind_of<Object>;
    keep(std::make_shared<Plugin<Object>>(std::move(plugin)));
  }

 protected:
  ~Registrar() = default;
  virtual void keep(std::shared_ptr<PluginInfo> plugin) = 0;
};

// Compiled once, in the kernel; those of the laboratory's kinds where they are used.
extern template void Registrar::add(Plugin<Integrator>);
extern template void Registrar::add(Plugin<Force>);
extern template void Registrar::add(Plugin<Field>);
extern template void Registrar::add(Plugin<Collider>);
extern template void Registrar::add(Plugin<RigidMotion>);
extern template void Registrar::add(Plugin<ContactLaw>);
extern template void Registrar::add(Plugin<Constraint>);
extern template void Registrar::add(Plugin<StepCorrection>);
extern template void Registrar::add(Plugin<ImplicitSolvers>);

}  // namespace sim

// SIM_PLUGIN(Force, "gravity") { registrar.add(sim::ForcePlugin{...}); }
// In a program that links several (core/plugin/linked_plugins.h), SIM_PLUGIN_NAME, an identifier,
// tells the symbols of one from those of the others. Without it they are the exports of a library.
#ifdef SIM_PLUGIN_NAME
#define SIM_PLUGIN_JOIN(SYMBOL, NAME) SYMBOL##_##NAME
#define SIM_PLUGIN_NAMED(SYMBOL, NAME) SIM_PLUGIN_JOIN(SYMBOL, NAME)
#define SIM_PLUGIN_SYMBOL(SYMBOL) SIM_PLUGIN_NAMED(SYMBOL, SIM_PLUGIN_NAME)
#define SIM_PLUGIN_CARD visibility("hidden")
#define SIM_PLUGIN_EXPORT visibility("hidden")
#else
#define SIM_PLUGIN_SYMBOL(SYMBOL) SYMBOL
#define SIM_PLUGIN_CARD section(".sim_plugin"), used, visibility("default")
#define SIM_PLUGIN_EXPORT visibility("default")
#endif
#define SIM_PLUGIN(KIND, NAMES)                                                                    \
  extern "C" __attribute__((SIM_PLUGIN_CARD)) constinit const ::sim::PluginCard SIM_PLUGIN_SYMBOL( \
      sim_plugin_card) = ::sim::make_card<::sim::KIND>(NAMES);                                     \
  extern "C" __attribute__((SIM_PLUGIN_EXPORT)) void SIM_PLUGIN_SYMBOL(sim_plugin_register)(       \
      ::sim::Registrar & registrar);                                                               \
  void SIM_PLUGIN_SYMBOL(sim_plugin_register)(::sim::Registrar & registrar)
