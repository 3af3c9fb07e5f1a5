// Bullet: a soft body of the springs as links, solved by positions, that falls on a sphere; or
// cubes as rigid bodies on a plane. In single precision, as Debian builds it by default.
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

#include <map>
#include <memory>

#include "tests/bench/peers/peer.h"

namespace {

btVector3 vector(const double* x) {
  return {static_cast<btScalar>(x[0]), static_cast<btScalar>(x[1]), static_cast<btScalar>(x[2])};
}

class Bullet {
 public:
  explicit Bullet(peer::Scene scene) : scene_(std::move(scene)) { reset(); }

  std::string about() const {
    const int version = btGetVersion();
    return "Bullet " + std::to_string(version / 100) + "." + std::to_string(version % 100) +
           (scene_.half > 0 ? ", rigid bodies, 10 iterations" : ", soft body, 4 iterations") +
           ", single precision";
  }

  void reset() {
    world_ = std::make_unique<World>();
    btSoftRigidDynamicsWorld& world = world_->dynamics;
    world.setGravity(vector(scene_.g));
    world.getWorldInfo().m_gravity = vector(scene_.g);
    soft_ = nullptr;
    cubes_.clear();
    if (scene_.half > 0)
      add_cubes();
    else
      add_cloth();
  }

  double run(long steps) {
    const double start = peer::seconds_now();
    for (long step = 0; step < steps; ++step)
      world_->dynamics.stepSimulation(static_cast<btScalar>(scene_.h), 0);
    return peer::seconds_now() - start;
  }

  std::vector<double> positions() const {
    std::vector<double> x;
    const auto add = [&x](const btVector3& p) {
      for (int c = 0; c < 3; ++c) x.push_back(static_cast<double>(p.m_floats[c]));
    };
    for (const btRigidBody* cube : cubes_) add(cube->getCenterOfMassPosition());
    for (int i = 0; soft_ && i < soft_->m_nodes.size(); ++i) add(soft_->m_nodes[i].m_x);
    return x;
  }

 private:
  struct World {
    btSoftBodyRigidBodyCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    btSoftRigidDynamicsWorld dynamics{&dispatcher, &broadphase, &solver, &configuration};
    std::vector<std::unique_ptr<btCollisionShape>> shapes;
    std::vector<std::unique_ptr<btMotionState>> states;
    std::vector<std::unique_ptr<btRigidBody>> bodies;
    std::unique_ptr<btSoftBody> soft;

    World() {
      btSoftBodyWorldInfo& info = dynamics.getWorldInfo();
      info.m_broadphase = &broadphase;
      info.m_dispatcher = &dispatcher;
      info.air_density = 0;
      info.m_sparsesdf.Initialize();
    }
    ~World() {
      if (soft) dynamics.removeSoftBody(soft.get());
      for (const auto& body : bodies) dynamics.removeRigidBody(body.get());
    }
  };

  btRigidBody* add_body(std::unique_ptr<btCollisionShape> shape, double mass, const btVector3& x) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape->calculateLocalInertia(static_cast<btScalar>(mass), inertia);
    world_->states.push_back(
        std::make_unique<btDefaultMotionState>(btTransform(btQuaternion::getIdentity(), x)));
    btRigidBody::btRigidBodyConstructionInfo info(
        static_cast<btScalar>(mass), world_->states.back().get(), shape.get(), inertia);
    info.m_friction = static_cast<btScalar>(std::sqrt(scene_.friction));  // of pairs: the product
    world_->shapes.push_back(std::move(shape));
    world_->bodies.push_back(std::make_unique<btRigidBody>(info));
    btRigidBody* const body = world_->bodies.back().get();
    body->setActivationState(DISABLE_DEACTIVATION);
    world_->dynamics.addRigidBody(body);
    return body;
  }

  void add_cubes() {
    add_body(std::make_unique<btStaticPlaneShape>(btVector3(0, 1, 0), btScalar(0)), 0, {0, 0, 0});
    const auto half = static_cast<btScalar>(scene_.half);
    for (std::size_t i = 0; i < scene_.mass.size(); ++i)
      cubes_.push_back(add_body(std::make_unique<btBoxShape>(btVector3(half, half, half)),
                                scene_.mass[i], vector(&scene_.x[3 * i])));
  }

  void add_cloth() {
    if (scene_.radius > 0)
      add_body(std::make_unique<btSphereShape>(static_cast<btScalar>(scene_.radius)), 0,
               vector(scene_.center));
    std::vector<btVector3> x;
    std::vector<btScalar> mass;
    for (std::size_t i = 0; i < scene_.mass.size(); ++i) {
      x.push_back(vector(&scene_.x[3 * i]));
      mass.push_back(static_cast<btScalar>(scene_.mass[i]));
    }
    world_->soft = std::make_unique<btSoftBody>(&world_->dynamics.getWorldInfo(), scene_.n,
                                                x.data(), mass.data());
    soft_ = world_->soft.get();
    soft_->m_materials[0]->m_kLST = 1;
    for (const peer::Spring& spring : scene_.springs) soft_->appendLink(spring.a, spring.b);
    for (const int id : scene_.pinned) soft_->setMass(id, 0);
    soft_->m_cfg.piterations = 4;
    soft_->m_cfg.kDF = static_cast<btScalar>(scene_.friction);
    soft_->m_cfg.kDP = 0;
    soft_->m_cfg.collisions = btSoftBody::fCollision::SDF_RS;
    soft_->getCollisionShape()->setMargin(btScalar(0.005));
    world_->dynamics.addSoftBody(soft_);
  }

  peer::Scene scene_;
  std::unique_ptr<World> world_;
  btSoftBody* soft_ = nullptr;
  std::vector<btRigidBody*> cubes_;
};

}  // namespace

int main(int argc, char** argv) { return peer::serve<Bullet>(argc, argv); }
