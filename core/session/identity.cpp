#include "core/session/identity.h"

#include <algorithm>

#include "core/geometry/rigid_motion.h"
#include "core/geometry/triangle_mesh.h"
#include "core/particles/collider.h"
#include "core/particles/constraint.h"
#include "core/particles/rigid/rigid_body.h"
#include "core/session/spec_fields.h"

namespace sim {

template <>
struct FieldsOf<Pose> {
  static constexpr StructField list[] = {{"center"}, {"velocity"}, {"axis"},
                                         {"sine"},   {"cosine"},   {"rate"}};
};

namespace {

// Motions and colliders are code: two of them that agree at these times count as equal.
constexpr double kTimes[] = {0, 0.7071, 1.618, 3.1416, 27.18};
const Vec3 kPoints[] = {{0, 0, 0}, {0.7, -1.3, 2.1}, {-17, 11, 5}};

}  // namespace

std::uint64_t digest(const TriangleMesh& mesh) {
  StateHash hash;
  hash.add(digest(mesh.particles()));
  hash.add(digest(mesh.ids()));
  return hash.value();
}

// A sampled motion is a function of the scene, whose code is not compared.
std::uint64_t digest(const RigidMotion& motion) {
  StateHash hash;
  hash.add(std::uint64_t{motion.sampled()});
  if (!motion.sampled())
    for (const double t : kTimes) hash.add(digest(motion.at(t, {0, 0, 0})));
  return hash.value();
}

std::uint64_t digest(const Curve& curve) { return digest(curve.moves()); }

std::uint64_t digest(const ColliderMaker& maker) {
  StateHash hash;
  hash.add(digest(maker.text));
  const std::unique_ptr<Collider> collider = maker.make();
  hash.add(digest(collider->material()));
  if (collider->sampled()) return hash.value();
  collider->bind({});
  for (const double t : kTimes)
    for (const Vec3& x : kPoints) {
      const SurfaceSample sample = collider->query(t, x);
      hash.add(sample.gap);
      hash.add(digest(sample.normal));
      hash.add(digest(sample.velocity));
    }
  return hash.value();
}

// Sampled at so many speeds that no parameter of a law acts between them alone.
std::uint64_t digest(const ContactLaw& law) {
  constexpr double kSlowest = 1e-9, kFastest = 1e4, kRatio = 1.3;  // m/s
  StateHash hash;
  hash.add(law.restitution(0));
  hash.add(law.friction(0));
  for (double speed = kSlowest; speed < kFastest; speed *= kRatio) {
    hash.add(law.restitution(speed));
    hash.add(law.friction(speed));
  }
  return hash.value();
}

std::uint64_t digest(const RigidBody& body) {
  StateHash hash;
  hash.add(digest(body.shape()));
  hash.add(body.mass());
  hash.add(digest(body.first()));
  return hash.value();
}

namespace {

// Calls itself for structs, parts and parameters; a digest stands for everything else.
template <class T>
void add(const std::string& path, const T& value, SceneIdentity& out) {
  if constexpr (std::is_same_v<T, std::vector<PartSpec>>) {
    for (std::size_t i = 0; i < value.size(); ++i)
      add(path + "[" + std::to_string(i) + "] '" + value[i].plugin + "'", value[i], out);
  } else if constexpr (std::is_same_v<T, std::map<std::string, Value>>) {
    for (const auto& [name, each] : value) out[path + "." + name] = digest(each);
  } else if constexpr (std::is_same_v<T, ContactSpec>) {
    // Its values were fields in earlier versions, and checkpoints still know them as such.
    out[path] = 0;
    each_own_field(value, [&](const StructField& field, const auto& content, std::uint64_t) {
      if (field.name != std::string_view("given")) add(path + "." + field.name, content, out);
    });
    for (const auto& [name, each] : value.given)
      out[path + "." + name] = std::visit([](const auto& own) { return digest(own); }, each);
  } else if constexpr (HasFields<T>) {
    out[path] = 0;  // it is there
    each_own_field(value, [&](const StructField& field, const auto& content, std::uint64_t) {
      add(path + "." + field.name, content, out);
    });
  } else if constexpr (requires {
                         requires HasFields<typename T::value_type>;
                         *value;
                       }) {
    add(path, *value, out);
  } else {
    out[path] = digest(value);
  }
}

}  // namespace

SceneIdentity scene_identity(const SystemSpec& spec) {
  SceneIdentity identity;
  each_own_field(spec, [&](const StructField& field, const auto& content, std::uint64_t) {
    add(field.name, content, identity);
  });
  return identity;
}

std::vector<std::string> differing(const SceneIdentity& a, const SceneIdentity& b) {
  std::vector<std::string> paths;
  for (const auto& [path, digest] : a)
    if (const auto other = b.find(path); other == b.end() || other->second != digest)
      paths.push_back(path);
  for (const auto& [path, digest] : b)
    if (!a.contains(path)) paths.push_back(path);
  std::ranges::sort(paths);
  return paths;
}

}  // namespace sim
