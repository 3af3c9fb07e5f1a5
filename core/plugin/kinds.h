// The kinds of plugins, each a type of object: a specialisation of Kind says what it is called,
// where its libraries lie and how an object is made. Lists, folders and the registry follow.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string_view>
#include <type_traits>

#include "core/fields/field.h"
#include "core/ode/integrator.h"
#include "core/particles/collider.h"
#include "core/particles/constraint.h"
#include "core/particles/force.h"
#include "core/particles/rigid_motion.h"
#include "core/plugin/elements.h"
#include "core/plugin/params.h"

namespace sim {

class Writer;       // core/output/writer.h
struct WriterTask;  // what it is to write
class View;         // core/output/view.h
struct ViewTask;    // what it is to show

template <class Object>
struct Kind;

template <>
struct Kind<Integrator> {
  static constexpr std::string_view name = "integrator", folder = "integrators";
  using Make = std::function<std::unique_ptr<Integrator>(const Params&)>;
};

template <>
struct Kind<Force> {
  static constexpr std::string_view name = "force", folder = "forces";
  using Make = std::function<std::unique_ptr<Force>(const Params&, const Elements&)>;
};

template <>
struct Kind<Field> {
  static constexpr std::string_view name = "field", folder = "fields";
  using Make = std::function<std::unique_ptr<Field>(const Params&)>;
};

template <>
struct Kind<Collider> {
  static constexpr std::string_view name = "collider", folder = "colliders";
  using Make = std::function<std::unique_ptr<Collider>(const Params&)>;
};

template <>
struct Kind<Constraint> {
  static constexpr std::string_view name = "constraint", folder = "constraints";
  using Make = std::function<std::unique_ptr<Constraint>(const Params&, const Elements&)>;
};

template <>
struct Kind<RigidMotion> {
  static constexpr std::string_view name = "motion", folder = "motions";
  using Make = std::function<std::unique_ptr<RigidMotion>(const Params&)>;
};

template <>
struct Kind<Writer> {
  static constexpr std::string_view name = "writer", folder = "writers";
  using Make = std::function<std::unique_ptr<Writer>(const Params&, const WriterTask&)>;
};

template <>
struct Kind<View> {
  static constexpr std::string_view name = "view", folder = "view";
  using Make = std::function<std::unique_ptr<View>(const Params&, const ViewTask&)>;
};

// A kind as a value. The list of all kinds gives the order in which they are shown and numbered.
struct PluginKind {
  std::uint32_t number;     // on the cards of plugins
  std::string_view name;    // sim.NAME.PLUGIN { ... } in a scene
  std::string_view folder;  // below a plugin folder; also the plural of the name
  bool in_scenes = true;    // or a scene never names one: files are for the command line
  bool operator==(const PluginKind&) const = default;
};

template <class... Objects>
struct KindList {
  static constexpr std::array<PluginKind, sizeof...(Objects)> all() {
    std::uint32_t number = 0;
    return {PluginKind{number++, Kind<Objects>::name, Kind<Objects>::folder,
                       !std::is_same_v<Objects, Writer> && !std::is_same_v<Objects, View>}...};
  }
  template <class Object>
  static constexpr std::size_t index() {
    std::size_t i = 0;
    static_cast<void>(((std::is_same_v<Object, Objects> || (++i, false)) || ...));
    return i;
  }
};

using Kinds = KindList<Integrator, Force, Field, Collider, RigidMotion, Writer, View, Constraint>;
inline constexpr auto kPluginKinds = Kinds::all();

template <class Object>
inline constexpr PluginKind kind_of = kPluginKinds[Kinds::index<Object>()];

}  // namespace sim
