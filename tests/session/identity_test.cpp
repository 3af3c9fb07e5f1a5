// The identity of a scene: every field of its parts is in it, also those that are added later.
#include "core/session/identity.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <set>

#include "core/base/error.h"
#include "core/geometry/rigid_motion.h"
#include "core/geometry/triangle_mesh.h"
#include "core/particles/collider.h"
#include "core/particles/constraint.h"
#include "core/particles/rigid/rigid_body.h"
#include "core/session/checkpoint.h"
#include "core/session/spec_fields.h"
#include "tests/support/scenes.h"

using namespace sim_test;

namespace {

struct Circling final : sim::RigidMotion {
  explicit Circling(double angular) : rate(angular) {}
  sim::Pose at(double t, const sim::Vec3& center) const override {
    sim::Pose pose;
    pose.center = center;
    pose.sine = std::sin(rate * t);
    pose.cosine = std::cos(rate * t);
    pose.rate = rate;
    return pose;
  }
  double rate;
};

struct Line final : sim::Curve {
  sim::Vec3 at(double s, double) const override { return {s, 0, 0}; }
  bool moves() const override { return false; }
};

struct Ground final : sim::Collider {
  explicit Ground(double level) : height(level) {}
  sim::ContactMaterial material() const override { return {}; }
  sim::SurfaceSample query(double, const sim::Vec3& x) const override { return {x.y() - height}; }
  double height;
};

struct Slippery final : sim::ContactLaw {
  explicit Slippery(double bounce) : bounces(bounce) {}
  double restitution(double) const override { return bounces; }
  double friction(double) const override { return 0; }
  double bounces;
};

std::shared_ptr<const sim::ColliderMaker> ground(double height) {
  return std::make_shared<const sim::ColliderMaker>(
      sim::ColliderMaker{[height] { return std::make_unique<Ground>(height); }, "ground"});
}

std::shared_ptr<const sim::TriangleMesh> triangle(int particles) {
  return std::make_shared<const sim::TriangleMesh>(
      particles, std::vector<sim::TriangleMesh::Triangle>{{0, 1, 2}});
}

std::shared_ptr<const sim::RigidBody> ball(double mass) {
  sim::RigidShape shape;
  shape.radius = 1;
  return std::make_shared<const sim::RigidBody>(std::make_shared<const sim::RigidShape>(shape),
                                                mass, 0);
}

// Changes one thing after the other in a scene, puts it back, and holds the identity to it.
class Changes {
 public:
  explicit Changes(sim::SystemSpec& spec) : spec_(spec) {}

  std::set<std::string> paths;       // of all that was changed
  std::set<std::string> describing;  // names of fields that do not identify

  template <class T>
  void of(T& value, const std::string& path, bool identifies) {
    if constexpr (std::is_same_v<T, bool>) {
      set(value, !value, path, identifies);
    } else if constexpr (std::is_same_v<T, double>) {
      set(value, std::isnan(value) ? 1 : std::nextafter(value, 1e300), path, identifies);
    } else if constexpr (std::is_integral_v<T> || std::is_enum_v<T>) {
      set(value, static_cast<T>(static_cast<int>(value) + 1), path, identifies);
    } else if constexpr (std::is_same_v<T, std::string>) {
      set(value, value + "x", path, identifies);
    } else if constexpr (sim::HasFields<T>) {
      sim::each_field(value, [&](const sim::StructField& field, auto& content) {
        if (!field.identifies) describing.insert(field.name);
        of(content, path + "." + field.name, identifies && field.identifies);
      });
    } else {
      inside(value, path, identifies);
    }
  }

 private:
  template <class T>
  void set(T& value, T other, const std::string& path, bool identifies) {
    INFO(path);
    const sim::SceneIdentity before = sim::scene_identity(spec_);
    std::swap(value, other);
    CHECK(sim::differing(before, sim::scene_identity(spec_)).empty() == !identifies);
    std::swap(value, other);
    paths.insert(path);
  }

  template <class T>
  void inside(std::optional<T>& value, const std::string& path, bool identifies) {
    set(value, value ? std::optional<T>() : std::optional<T>(T()), path, identifies);
    if (value) of(*value, path, identifies);
  }
  template <class T>
  void inside(std::vector<T>& list, const std::string& path, bool identifies) {
    std::vector<T> more = list;
    more.emplace_back();
    set(list, more, path, identifies);
    for (T& each : list) of(each, path, identifies);
  }
  template <class T, std::size_t n>
  void inside(std::array<T, n>& list, const std::string& path, bool identifies) {
    for (T& each : list) of(each, path, identifies);
  }
  template <class T>
  void inside(std::map<std::string, T>& values, const std::string& path, bool identifies) {
    auto more = values;
    more["another name"] = T();
    set(values, more, path, identifies);
    for (auto& [name, each] : values) of(each, path + "." + name, identifies);
  }
  void inside(sim::Vec3& v, const std::string& path, bool identifies) {
    for (std::size_t axis = 0; axis < 3; ++axis) of(v[axis], path, identifies);
  }
  void inside(sim::Value& value, const std::string& path, bool identifies) {
    set(value, sim::Value(std::string("another value")), path, identifies);
    std::visit([&](auto& content) { of(content, path, identifies); },
               static_cast<sim::AnyValue&>(value));
  }
  void inside(std::monostate&, const std::string&, bool) {}
  template <class... T>
  void inside(std::function<T...>& function, const std::string& path, bool identifies) {
    set(function, std::function<T...>(), path, identifies && function);
  }
  template <class T>
  requires sim::HasFields<T>
  void inside(std::shared_ptr<const T>& value, const std::string& path, bool identifies) {
    const auto copy = std::make_shared<T>(*value);
    value = copy;
    of(*copy, path, identifies);
  }
  void inside(std::shared_ptr<const sim::TriangleMesh>& mesh, const std::string& path,
              bool identifies) {
    set(mesh, triangle(4), path, identifies);
  }
  void inside(std::shared_ptr<const sim::RigidMotion>& motion, const std::string& path,
              bool identifies) {
    set(motion, {std::make_shared<const Circling>(1 + 1e-12)}, path, identifies);
  }
  void inside(std::shared_ptr<const sim::ContactLaw>& law, const std::string& path,
              bool identifies) {
    set(law, {std::make_shared<const Slippery>(0.5 + 1e-12)}, path, identifies);
  }
  void inside(std::shared_ptr<const sim::ColliderMaker>& maker, const std::string& path,
              bool identifies) {
    set(maker, ground(1e-12), path, identifies);
  }
  void inside(std::shared_ptr<const sim::Curve>& curve, const std::string& path, bool identifies) {
    set(curve, {}, path, identifies);
  }
  void inside(std::shared_ptr<const sim::RigidBody>& body, const std::string& path,
              bool identifies) {
    set(body, ball(2), path, identifies);
  }
  // A field whose type this does not know must not identify a scene.
  template <class T>
  void inside(T&, const std::string& path, bool identifies) {
    INFO(path << ": add its type to this test");
    CHECK_FALSE(identifies);
  }

  sim::SystemSpec& spec_;
};

// A part with something in every field.
sim::PartSpec make_full_part() {
  sim::PartSpec part;
  part.plugin = "spring";
  part.given = {{"none", {}},
                {"flag", true},
                {"count", std::int64_t{3}},
                {"k", 0.1},
                {"law", std::string("neo")},
                {"g", sim::Vec3{0, -9.81, 0}},
                {"field", sim::OdeFunction([](double, auto, auto) {})},
                {"function", sim::ParticleFunction([](const auto&, auto, auto) {})},
                {"surface", triangle(3)},
                {"motion", std::shared_ptr<const sim::RigidMotion>(new Circling(1))},
                {"collider", ground(0)},
                {"material", std::shared_ptr<const sim::ContactLaw>(new Slippery(0.5))},
                {"curve", std::shared_ptr<const sim::Curve>(new Line)},
                {"boundary", sim::Colliders{ground(0)}},
                {"bodies", sim::Bodies{ball(1)}}};
  part.elements.grids.push_back({0, {2, 2, 1}, {0, 1, 0}, 0.5});
  part.elements.ids = {0, 1};
  part.elements.values["rest"] = {0.5};
  part.particles = {0, 1};
  part.place = "a.lua:3";
  return part;
}

sim::SystemSpec make_full_scene() {
  sim::SystemSpec spec;
  sim::ParticlesSpec& particles = spec.particles.emplace();
  particles.grid = {{2, 2, 1}};
  particles.list = {{}};
  particles.pinned = {0};
  particles.prescribed = {{0, std::make_shared<const Circling>(1), "a.lua:1"}};
  particles.weights = {1};
  spec.forces = {make_full_part(), make_part("gravity")};
  spec.colliders = spec.constraints = {make_full_part()};
  sim::RigidShape shape;
  shape.points = {{1, 0, 0}};
  shape.triangles = {{0, 0, 0}};
  spec.bodies.resize(1);
  spec.bodies[0].shape = std::make_shared<const sim::RigidShape>(shape);
  spec.points = {{0, {1, 0, 0}}};
  spec.surfaces = {triangle(3)};
  spec.contact = sim::ContactSpec{{triangle(3)}, {{"thickness", 0.01}, {"friction", 0.5}}};
  spec.loads = {{1, 0, 0}};
  spec.first_order = {3, {1, 0, 0}, make_full_part()};
  return spec;
}

}  // namespace

TEST_CASE("each field of each part of a scene is in its identity, but for what only describes it") {
  sim::SystemSpec spec = make_full_scene();
  Changes changes(spec);
  changes.of(spec, "", true);
  // Only these may change: lines of files, names, looks, what a checkpoint holds by itself, and
  // which particles of the list are grids.
  CHECK(changes.describing == std::set<std::string>{"added_grids", "dt", "duration", "error",
                                                    "exact", "first", "integrator", "look", "name",
                                                    "observers", "on", "one_thread", "place"});
  // The walk has been everywhere.
  for (const char* path : {".name",
                           ".dt",
                           ".accuracy",
                           ".contact.given.friction",
                           ".contact.plugin",
                           ".contact.surfaces",
                           ".forces.given.k",
                           ".forces.given.motion",
                           ".forces.elements.values.rest",
                           ".forces.elements.grids.length",
                           ".forces.particles",
                           ".forces.place",
                           ".colliders.plugin",
                           ".constraints.elements.ids",
                           ".bodies.shape.radius",
                           ".bodies.shape.triangles",
                           ".bodies.surface.friction",
                           ".bodies.touches",
                           ".points.at",
                           ".loads",
                           ".surfaces",
                           ".particles.grid.du",
                           ".particles.list.velocity",
                           ".particles.leads.path",
                           ".particles.pinned",
                           ".particles.weights",
                           ".first_order.field.given.g",
                           ".first_order.state"})
    CHECK(changes.paths.contains(path));
}

TEST_CASE("what differs between two scenes is named") {
  const sim::SystemSpec cloth = make_cloth(4);
  sim::SystemSpec other = make_cloth(4);
  CHECK(sim::differing(sim::scene_identity(cloth), sim::scene_identity(other)).empty());
  other.forces[1].given["k"] = 3.0;
  other.contact = sim::ContactSpec{{}, {{"thickness", 0.01}}};
  CHECK(sim::differing(sim::scene_identity(cloth), sim::scene_identity(other)) ==
        std::vector<std::string>{"contact", "contact.thickness",
                                 "forces[1] '" + cloth.forces[1].plugin + "'.given.k"});
}

// Checkpoints of versions in which contact was no plugin have these.
TEST_CASE("numbers of contact are known by their own digests, and defaults by none") {
  sim::SystemSpec spec = make_cloth(4);
  spec.contact = sim::ContactSpec{{triangle(16)}, {{"thickness", 0.01}, {"self", false}}};
  const sim::SceneIdentity identity = sim::scene_identity(spec);
  CHECK(identity.at("contact") == 0);
  CHECK(identity.at("contact.thickness") == sim::digest(0.01));
  CHECK(identity.at("contact.self") == sim::digest(false));
  for (const char* path : {"contact.plugin", "contact.given", "contact.friction", "body_contact"})
    CHECK_FALSE(identity.contains(path));
  spec.contact->plugin = "other";
  CHECK(sim::differing(identity, sim::scene_identity(spec)) ==
        std::vector<std::string>{"contact.plugin"});
}

TEST_CASE("a checkpoint is refused when the friction of a contact was changed") {
  sim::Registry registry = make_registry();
  sim::SystemSpec cloth = make_cloth(4);
  const auto sheet =
      std::make_shared<const sim::TriangleMesh>(16, sim::grid_triangles({4, 4, 1}, false));
  cloth.contact = sim::ContactSpec{{sheet}, {{"thickness", 0.01}, {"friction", 0.3}}};
  sim::Simulation from(cloth, registry);
  REQUIRE(run(from, 3));
  const sim::Checkpoint::System saved = sim::checkpoint(from, cloth, 0);
  sim::Simulation same(cloth, registry);
  CHECK_NOTHROW(sim::resume(same, cloth, saved, registry));
  cloth.contact->given["friction"] = 0.31;
  sim::Simulation other(cloth, registry);
  CHECK_THROWS_WITH(sim::resume(other, cloth, saved, registry),
                    Catch::Contains("contact.friction"));
}
