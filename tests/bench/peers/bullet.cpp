// Bullet: a soft body of the springs as links, solved by positions, that falls on a sphere; or
// cubes as rigid bodies on a plane.
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>

#include "tests/bench/peers/bullet.h"

namespace {

class Bullet {
 public:
  explicit Bullet(peer::Scene scene) : scene_(std::move(scene)) { reset(); }

  std::string about() const {
    return peer::bullet_version() +
           (scene_.half > 0 ? ", rigid bodies, 10 iterations" : ", soft body, 4 iterations") +
           ", single precision";
  }

  void reset() {
    world_ = std::make_unique<World>(scene_.friction);
    btSoftRigidDynamicsWorld& world = world_->dynamics;
    world.setGravity(peer::vector(scene_.g));
    world.getWorldInfo().m_gravity = peer::vector(scene_.g);
    cubes_.clear();
    if (scene_.half > 0)
      add_cubes();
    else
      add_cloth();
  }

  double run(long steps) { return peer::run(world_->dynamics, scene_.h, steps); }

  std::vector<double> positions() const {
    std::vector<double> x;
    for (const btRigidBody* cube : cubes_) peer::append(cube->getCenterOfMassPosition(), x);
    const btSoftBody* const cloth = world_->cloth.get();
    for (int i = 0; cloth && i < cloth->m_nodes.size(); ++i) peer::append(cloth->m_nodes[i].m_x, x);
    return x;
  }

 private:
  struct World {
    btSoftBodyRigidBodyCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    btSoftRigidDynamicsWorld dynamics{&dispatcher, &broadphase, &solver, &configuration};
    std::unique_ptr<btSoftBody> cloth;
    peer::Bodies bodies;

    explicit World(double friction) : bodies(friction) {
      btSoftBodyWorldInfo& info = dynamics.getWorldInfo();
      info.m_broadphase = &broadphase;
      info.m_dispatcher = &dispatcher;
      info.air_density = 0;
      info.m_sparsesdf.Initialize();
    }
    ~World() {
      if (cloth) dynamics.removeSoftBody(cloth.get());
      bodies.leave(dynamics);
    }
  };

  void add_cubes() {
    world_->bodies.add_plane(world_->dynamics, 0);
    const auto half = static_cast<btScalar>(scene_.half);
    for (std::size_t i = 0; i < scene_.mass.size(); ++i)
      cubes_.push_back(world_->bodies.add(world_->dynamics,
                                          std::make_unique<btBoxShape>(btVector3(half, half, half)),
                                          scene_.mass[i], peer::vector(&scene_.x[3 * i])));
  }

  void add_cloth() {
    if (scene_.radius > 0)
      world_->bodies.add_sphere(world_->dynamics, scene_.radius, peer::vector(scene_.center));
    world_->cloth = peer::make_cloth(scene_, world_->dynamics.getWorldInfo());
    btSoftBody& cloth = *world_->cloth;
    cloth.m_materials[0]->m_kLST = 1;
    cloth.m_cfg.piterations = 4;
    cloth.m_cfg.kDF = static_cast<btScalar>(scene_.friction);
    cloth.m_cfg.kDP = 0;
    cloth.m_cfg.collisions = btSoftBody::fCollision::SDF_RS;
    cloth.getCollisionShape()->setMargin(btScalar(0.005));
    world_->dynamics.addSoftBody(&cloth);
  }

  peer::Scene scene_;
  std::unique_ptr<World> world_;
  std::vector<btRigidBody*> cubes_;
};

}  // namespace

int main(int argc, char** argv) { return peer::serve<Bullet>(argc, argv); }
