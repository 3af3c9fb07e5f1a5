// The common part of all kinds of plugins: a name, a folder, a number on the cards of their
// libraries.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <type_traits>

namespace sim {

// The kind of objects of that type: their `name`, their `folder`, and a function `Make` that makes
// one.
template <class Object>
struct Kind;

// A kind as a value. The list of all kinds gives the order in which they are shown and numbered.
struct PluginKind {
  std::uint32_t number;     // on the cards of plugins
  std::string_view name;    // sim.NAME.PLUGIN { ... } in a scene
  std::string_view folder;  // below a plugin folder; also the plural of the name
  bool in_scenes = true;    // or a scene never names one: it is for the command line
  bool operator==(const PluginKind&) const = default;
};

// A scene may name plugins of the kind, unless the kind says otherwise.
template <class Object>
constexpr bool named_in_scenes() {
  if constexpr (requires { Kind<Object>::in_scenes; }) return Kind<Object>::in_scenes;
  return true;
}

template <class... Objects>
struct KindList {
  static constexpr std::array<PluginKind, sizeof...(Objects)> all() {
    std::uint32_t number = 0;
    return {PluginKind{number++, Kind<Objects>::name, Kind<Objects>::folder,
                       named_in_scenes<Objects>()}...};
  }
  template <class Object>
  static constexpr std::size_t index() {
    std::size_t i = 0;
    static_cast<void>(((std::is_same_v<Object, Objects> || (++i, false)) || ...));
    return i;
  }
};

}  // namespace sim
