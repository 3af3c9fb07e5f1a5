// The fields of the parts of a scene. The fields that do not identify a part are its source
// location, its look, and those that a run chooses and a checkpoint stores separately.
#pragma once

#include "core/scene/scene_spec.h"
#include "core/session/fields.h"

namespace sim {

inline constexpr bool kDescribes = false;  // for StructField::identifies

template <>
struct FieldsOf<GridPairs> {
  static constexpr StructField list[] = {{"first"}, {"size"}, {"step"}, {"length"}};
};

template <>
struct FieldsOf<Elements> {
  static constexpr StructField list[] = {{"arity"}, {"cells"},  {"grids"},
                                         {"ids"},   {"values"}, {"carried"}};
};

template <>
struct FieldsOf<PartSpec> {
  static constexpr StructField list[] = {
      {"plugin"},      {"given"},          {"elements"}, {"particles"}, {"place", kDescribes},
      {"switch_name"}, {"on", kDescribes}, {"stiff"}};
};

template <>
struct FieldsOf<GridSpec> {
  static constexpr StructField list[] = {
      {"size"}, {"origin"}, {"du"},         {"dv"},
      {"dw"},   {"mass"},   {"directions"}, {"first", kDescribes}};
};

template <>
struct FieldsOf<ParticleSpec> {
  static constexpr StructField list[] = {{"position"}, {"velocity"}, {"mass"}};
};

template <>
struct FieldsOf<PrescribedSpec> {
  static constexpr StructField list[] = {{"particle"}, {"path"}, {"place", kDescribes}};
};

template <>
struct FieldsOf<ParticlesSpec> {
  static constexpr StructField list[] = {{"grid"},
                                         {"list"},
                                         {"pinned"},
                                         {"leads"},
                                         {"weights"},
                                         {"numbers"},
                                         {"added_grids", kDescribes}};
};

template <>
struct FieldsOf<RigidShape> {
  static constexpr StructField list[] = {{"form"},   {"half"},   {"radius"},
                                         {"length"}, {"points"}, {"triangles"},
                                         {"parts"},  {"at"},     {"rotation"}};
};

template <>
struct FieldsOf<ContactMaterial> {
  static constexpr StructField list[] = {{"restitution"}, {"friction"}, {"law"}};
};

template <>
struct FieldsOf<RigidSpec> {
  static constexpr StructField list[] = {
      {"shape"}, {"mass"},    {"position"}, {"turn"},  {"velocity"},
      {"spin"},  {"surface"}, {"touches"},  {"first"}, {"place", kDescribes}};
};

template <>
struct FieldsOf<BodyPoint> {
  static constexpr StructField list[] = {{"body"}, {"at"}};
};

template <>
struct FieldsOf<ContactSpec> {
  static constexpr StructField list[] = {
      {"surfaces"}, {"given"}, {"plugin"}, {"place", kDescribes}};
};

template <>
struct FieldsOf<FirstOrderSpec> {
  static constexpr StructField list[] = {{"dimension"}, {"state"}, {"field"}};
};

template <>
struct FieldsOf<SleepSpec> {
  static constexpr StructField list[] = {{"energy"}, {"after"}};
};

template <>
struct FieldsOf<SystemSpec> {
  static constexpr StructField list[] = {{"name", kDescribes},
                                         {"particles"},
                                         {"forces"},
                                         {"colliders"},
                                         {"constraints"},
                                         {"accuracy"},
                                         {"bodies"},
                                         {"points"},
                                         {"surfaces"},
                                         {"contact"},
                                         {"body_contact"},
                                         {"loads"},
                                         {"first_order"},
                                         {"integrator", kDescribes},
                                         {"dt", kDescribes},
                                         {"duration", kDescribes},
                                         {"error", kDescribes},
                                         {"sleep"},
                                         {"place", kDescribes},
                                         {"exact", kDescribes},
                                         {"one_thread", kDescribes},
                                         {"look", kDescribes},
                                         {"observers", kDescribes}};
};

}  // namespace sim
