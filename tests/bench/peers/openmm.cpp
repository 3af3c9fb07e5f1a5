// OpenMM: harmonic bonds under the Langevin middle integrator at temperature zero, on one thread of
// the CPU platform. Nanometres, picoseconds and atomic mass units are a consistent system, so the
// numbers of the scene are used as they are.
#include <OpenMM.h>

#include <map>
#include <memory>

#include "tests/bench/peers/peer.h"

namespace {

class OpenMm {
 public:
  explicit OpenMm(peer::Scene scene)
      : scene_(std::move(scene)), integrator_(0, scene_.drag / scene_.mass[0], scene_.h) {
    for (int i = 0; i < scene_.n; ++i)
      system_.addParticle(scene_.mass[static_cast<std::size_t>(i)]);
    for (const int id : scene_.pinned) system_.setParticleMass(id, 0);  // does not move
    auto* const bonds = new OpenMM::HarmonicBondForce;
    for (const peer::Spring& s : scene_.springs) bonds->addBond(s.a, s.b, s.rest, s.k);
    auto* const weight = new OpenMM::CustomExternalForce("-m*(gx*x+gy*y+gz*z)");
    weight->addPerParticleParameter("m");
    const char* const names[] = {"gx", "gy", "gz"};
    for (int c = 0; c < 3; ++c) weight->addGlobalParameter(names[c], scene_.g[c]);
    for (int i = 0; i < scene_.n; ++i)
      weight->addParticle(i, {scene_.mass[static_cast<std::size_t>(i)]});
    system_.addForce(bonds);
    system_.addForce(weight);
    OpenMM::Platform::loadPluginsFromDirectory(OpenMM::Platform::getDefaultPluginsDirectory());
    auto& platform = OpenMM::Platform::getPlatformByName("CPU");
    context_ = std::make_unique<OpenMM::Context>(
        system_, integrator_, platform, std::map<std::string, std::string>{{"Threads", "1"}});
    reset();
  }

  std::string about() const {
    return "OpenMM " + OpenMM::Platform::getOpenMMVersion() + " " +
           context_->getPlatform().getName() +
           " platform, LangevinMiddleIntegrator at temperature 0";
  }

  // The method keeps velocities half a step behind: v(-h/2) = v(0) - h/2 a(0).
  void reset() {
    std::vector<OpenMM::Vec3> x, v;
    for (std::size_t i = 0; i < scene_.x.size(); i += 3) {
      x.emplace_back(scene_.x[i], scene_.x[i + 1], scene_.x[i + 2]);
      v.emplace_back(scene_.v[i], scene_.v[i + 1], scene_.v[i + 2]);
    }
    context_->setPositions(x);
    const auto forces = context_->getState(OpenMM::State::Forces).getForces();
    for (std::size_t i = 0; i < v.size(); ++i) v[i] -= forces[i] * (scene_.h / 2 / scene_.mass[i]);
    for (const int id : scene_.pinned) v[static_cast<std::size_t>(id)] = {};
    context_->setVelocities(v);
  }

  double run(long steps) {
    const double start = peer::seconds_now();
    integrator_.step(static_cast<int>(steps));
    return peer::seconds_now() - start;
  }

  std::vector<double> positions() const {
    std::vector<double> x;
    const OpenMM::State state = context_->getState(OpenMM::State::Positions);
    for (const OpenMM::Vec3& p : state.getPositions())
      for (int c = 0; c < 3; ++c) x.push_back(p[c]);
    return x;
  }

 private:
  peer::Scene scene_;
  OpenMM::System system_;
  OpenMM::LangevinMiddleIntegrator integrator_;
  std::unique_ptr<OpenMM::Context> context_;
};

}  // namespace

int main(int argc, char** argv) {
  try {
    return peer::serve<OpenMm>(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
