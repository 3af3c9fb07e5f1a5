// Bullet: a cloth that meets itself and falls on a sphere and the ground. Only Bullet's world of
// deformable bodies detects that: nodes of a soft body do not meet its own faces (VF_SS), and its
// clusters do nothing to each other (CL_SELF is in the mask of collision modes). Springs are
// forces, in implicit steps: these take the least time a second of the scene.
#include <BulletSoftBody/btDeformableBodySolver.h>
#include <BulletSoftBody/btDeformableGravityForce.h>
#include <BulletSoftBody/btDeformableMassSpringForce.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>

#include <algorithm>

#include "tests/bench/peers/bullet.h"

namespace {

struct World {
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btDeformableBodySolver cloth_solver;
  btDeformableMultiBodyConstraintSolver solver;
  btDeformableMultiBodyDynamicsWorld dynamics{&dispatcher, &broadphase, &solver, &configuration,
                                              &cloth_solver};
  btDeformableMassSpringForce springs;
  btDeformableGravityForce gravity;
  std::unique_ptr<btSoftBody> cloth;
  peer::Bodies bodies;

  explicit World(const peer::Scene& scene)
      : springs(springs_of(scene)), gravity(peer::vector(scene.g)), bodies(scene.friction) {
    solver.setDeformableSolver(&cloth_solver);
    dynamics.setImplicit(true);
    dynamics.setUseProjection(true);  // without, nothing moves in implicit steps
    dynamics.setGravity(peer::vector(scene.g));
    btSoftBodyWorldInfo& info = dynamics.getWorldInfo();
    info.m_gravity = peer::vector(scene.g);
    info.m_broadphase = &broadphase;
    info.m_dispatcher = &dispatcher;
    info.air_density = 0;
    info.m_sparsesdf.Reset();
    bodies.add_sphere(dynamics, scene.radius, peer::vector(scene.center));
    bodies.add_plane(dynamics, scene.ground);
    add_cloth(scene);
  }
  ~World() {
    dynamics.removeSoftBody(cloth.get());
    bodies.leave(dynamics);
  }
  World(const World&) = delete;
  World& operator=(const World&) = delete;

 private:
  static double weakest(const peer::Scene& scene) {
    return std::ranges::min(scene.springs, {}, &peer::Spring::k).k;
  }

  // The weakest family are the links that it calls bending. All others are as stiff as the mean of
  // the two stiff ones, and damped along themselves as the scene has it.
  static btDeformableMassSpringForce springs_of(const peer::Scene& scene) {
    const double stiffest = std::ranges::max(scene.springs, {}, &peer::Spring::k).k;
    constexpr double kDampingOverMass = 20;  // 1/s
    return {static_cast<btScalar>(0.75 * stiffest),
            static_cast<btScalar>(kDampingOverMass * scene.mass.front()), true, weakest(scene)};
  }

  void add_cloth(const peer::Scene& scene) {
    cloth = peer::make_cloth(scene, dynamics.getWorldInfo());
    const double weak = weakest(scene);
    for (std::size_t i = 0; i < scene.springs.size(); ++i)
      cloth->m_links[static_cast<int>(i)].m_bbending = scene.springs[i].k == weak;
    for (const auto& [a, b, c] : scene.triangles) cloth->appendFace(a, b, c);
    cloth->getCollisionShape()->setMargin(static_cast<btScalar>(scene.thickness));
    cloth->m_cfg.kDF = static_cast<btScalar>(std::sqrt(scene.friction));  // as of bodies
    cloth->m_cfg.kKHR = 1;
    cloth->m_cfg.kCHR = 1;
    using Collision = btSoftBody::fCollision;
    cloth->m_cfg.collisions = Collision::SDF_RD | Collision::SDF_RDN | Collision::VF_DD;
    cloth->setSelfCollision(true);
    cloth->setActivationState(DISABLE_DEACTIVATION);
    dynamics.addSoftBody(cloth.get());
    dynamics.addForce(cloth.get(), &springs);
    dynamics.addForce(cloth.get(), &gravity);
  }
};

class Deformable {
 public:
  explicit Deformable(peer::Scene scene) : scene_(std::move(scene)) { reset(); }

  std::string about() const {
    return peer::bullet_version() + ", deformable body, implicit steps, single precision";
  }

  void reset() { world_ = std::make_unique<World>(scene_); }

  double run(long steps) { return peer::run(world_->dynamics, scene_.h, steps); }

  std::vector<double> positions() const {
    std::vector<double> x;
    for (int i = 0; i < scene_.n; ++i) peer::append(world_->cloth->m_nodes[i].m_x, x);
    return x;
  }

 private:
  peer::Scene scene_;
  std::unique_ptr<World> world_;
};

}  // namespace

int main(int argc, char** argv) { return peer::serve<Deformable>(argc, argv); }
