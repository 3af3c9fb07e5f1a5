// The identity of a scene: equal for scenes with the same contents, part by part.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/scene/scene_spec.h"
#include "core/session/digest.h"

namespace sim {

// Digests of referenced objects; motions, colliders and laws are sampled at some times, points and
// speeds.
std::uint64_t digest(const TriangleMesh& mesh);
std::uint64_t digest(const RigidMotion& motion);
std::uint64_t digest(const Curve& curve);
std::uint64_t digest(const ColliderMaker& maker);
std::uint64_t digest(const ContactLaw& law);
std::uint64_t digest(const RigidBody& body);

// A digest of each part that differs from an empty scene, by its path: "contact.friction",
// "forces[1] 'drag'.given.k". The code of functions is not included: the inputs of a scene cover
// it.
using SceneIdentity = std::map<std::string, std::uint64_t>;

SceneIdentity scene_identity(const SystemSpec& spec);

// The paths that two of them do not share, in order.
std::vector<std::string> differing(const SceneIdentity& a, const SceneIdentity& b);

}  // namespace sim
