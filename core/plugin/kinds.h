// The kinds of plugins, each a type of object: a specialisation of Kind gives its name, the folder
// of its libraries and its constructor. Lists, folders and the registry follow from that.
#pragma once

#include <functional>
#include <memory>
#include <string_view>

#include "core/fields/field.h"
#include "core/geometry/rigid_motion.h"
#include "core/ode/integrator.h"
#include "core/particles/collider.h"
#include "core/particles/constraint.h"
#include "core/particles/force.h"
#include "core/plugin/elements.h"
#include "core/plugin/kind.h"
#include "core/plugin/params.h"

namespace sim {

class StepCorrection;   // core/particles/step_correction.h
struct ContactTask;     // core/particles/contact_task.h
class ImplicitSolvers;  // core/particles/implicit_solvers.h
class ParticleSystem;   // core/particles/particle_system.h

// Kinds of the laboratory, which the kernel knows by name only.
class Writer;       // core/output/writer.h
struct WriterTask;  // the task of a writer
class View;         // core/output/view.h
struct ViewTask;    // the task of a view
class Study;        // core/study/study.h
namespace engine {
class Engine;  // core/engine/engine.h
}

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
struct Kind<ContactLaw> {
  static constexpr std::string_view name = "law", folder = "laws";
  using Make = std::function<std::unique_ptr<ContactLaw>(const Params&)>;
};

template <>
struct Kind<StepCorrection> {
  static constexpr std::string_view name = "contact", folder = "contact";
  using Make = std::function<std::unique_ptr<StepCorrection>(const Params&, const ContactTask&)>;
};

template <>
struct Kind<ImplicitSolvers> {
  static constexpr std::string_view name = "solver", folder = "solvers";
  static constexpr bool in_scenes = false;
  using Make = std::function<std::unique_ptr<ImplicitSolvers>(const Params&, ParticleSystem&)>;
};

template <>
struct Kind<Writer> {
  static constexpr std::string_view name = "writer", folder = "writers";
  static constexpr bool in_scenes = false;
  using Make = std::function<std::unique_ptr<Writer>(const Params&, const WriterTask&)>;
};

template <>
struct Kind<View> {
  static constexpr std::string_view name = "view", folder = "view";
  static constexpr bool in_scenes = false;
  using Make = std::function<std::unique_ptr<View>(const Params&, const ViewTask&)>;
};

template <>
struct Kind<Study> {
  static constexpr std::string_view name = "study", folder = "studies";
  static constexpr bool in_scenes = false;
  using Make = std::function<std::unique_ptr<Study>(const Params&)>;
};

template <>
struct Kind<engine::Engine> {
  static constexpr std::string_view name = "engine", folder = "engines";
  static constexpr bool in_scenes = false;
  using Make = std::function<std::unique_ptr<engine::Engine>(const Params&)>;
};

// The kinds in the order in which they are shown and numbered.
using Kinds = KindList<Integrator, Force, Field, Collider, RigidMotion, Writer, View, Constraint,
                       Study, engine::Engine, StepCorrection, ContactLaw, ImplicitSolvers>;
inline constexpr auto kPluginKinds = Kinds::all();

template <class Object>
inline constexpr PluginKind kind_of = kPluginKinds[Kinds::index<Object>()];

}  // namespace sim
