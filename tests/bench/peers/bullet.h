// The code shared by the peers of Bullet. In single precision, as Debian builds it by default.
#pragma once

#include <BulletSoftBody/btSoftBody.h>
#include <btBulletDynamicsCommon.h>

#include <memory>

#include "tests/bench/peers/peer.h"

namespace peer {

inline btVector3 vector(const double* x) {
  return {static_cast<btScalar>(x[0]), static_cast<btScalar>(x[1]), static_cast<btScalar>(x[2])};
}

inline void append(const btVector3& p, std::vector<double>& x) {
  for (int c = 0; c < 3; ++c) x.push_back(static_cast<double>(p.m_floats[c]));
}

inline std::string bullet_version() {
  const int version = btGetVersion();
  return "Bullet " + std::to_string(version / 100) + "." + std::to_string(version % 100);
}

inline double run(btDynamicsWorld& world, double h, long steps) {
  const double start = seconds_now();
  for (long step = 0; step < steps; ++step) world.stepSimulation(static_cast<btScalar>(h), 0);
  return seconds_now() - start;
}

// Rigid bodies, with what belongs to them.
class Bodies {
 public:
  explicit Bodies(double friction) : friction_(friction) {}

  btRigidBody* add(btDynamicsWorld& world, std::unique_ptr<btCollisionShape> shape, double mass,
                   const btVector3& x) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape->calculateLocalInertia(static_cast<btScalar>(mass), inertia);
    states_.push_back(
        std::make_unique<btDefaultMotionState>(btTransform(btQuaternion::getIdentity(), x)));
    btRigidBody::btRigidBodyConstructionInfo info(static_cast<btScalar>(mass), states_.back().get(),
                                                  shape.get(), inertia);
    info.m_friction = static_cast<btScalar>(std::sqrt(friction_));  // of pairs: the product
    shapes_.push_back(std::move(shape));
    bodies_.push_back(std::make_unique<btRigidBody>(info));
    btRigidBody* const body = bodies_.back().get();
    body->setActivationState(DISABLE_DEACTIVATION);
    world.addRigidBody(body);
    return body;
  }
  void add_plane(btDynamicsWorld& world, double height) {
    add(world,
        std::make_unique<btStaticPlaneShape>(btVector3(0, 1, 0), static_cast<btScalar>(height)), 0,
        {0, 0, 0});
  }
  void add_sphere(btDynamicsWorld& world, double radius, const btVector3& center) {
    add(world, std::make_unique<btSphereShape>(static_cast<btScalar>(radius)), 0, center);
  }
  void leave(btDynamicsWorld& world) {
    for (const auto& body : bodies_) world.removeRigidBody(body.get());
  }

 private:
  double friction_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btMotionState>> states_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
};

// The particles of a scene as nodes, its springs as links.
inline std::unique_ptr<btSoftBody> make_cloth(const Scene& scene, btSoftBodyWorldInfo& world) {
  std::vector<btVector3> x;
  std::vector<btScalar> mass;
  for (std::size_t i = 0; i < scene.mass.size(); ++i) {
    x.push_back(vector(&scene.x[3 * i]));
    mass.push_back(static_cast<btScalar>(scene.mass[i]));
  }
  auto cloth = std::make_unique<btSoftBody>(&world, scene.n, x.data(), mass.data());
  for (const Spring& spring : scene.springs) cloth->appendLink(spring.a, spring.b);
  for (const int id : scene.pinned) cloth->setMass(id, 0);
  return cloth;
}

}  // namespace peer
