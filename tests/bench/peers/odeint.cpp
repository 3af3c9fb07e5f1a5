// Boost.odeint: runge_kutta4 with the right-hand side of peers/springs.h.
#include <boost/numeric/odeint.hpp>
#include <boost/version.hpp>

#include "tests/bench/peers/springs.h"

namespace {

class Odeint {
 public:
  explicit Odeint(peer::Scene scene) : scene_(std::move(scene)), f_(scene_) { reset(); }

  std::string about() const {
    return "Boost " BOOST_LIB_VERSION " odeint runge_kutta4, " + f_.about();
  }

  void reset() {
    x_ = scene_.x;
    x_.insert(x_.end(), scene_.v.begin(), scene_.v.end());
  }

  double run(long steps) {
    const auto f = [this](const State& x, State& dx, double) { f_(x.data(), dx.data()); };
    const double start = peer::seconds_now();
    for (long i = 0; i < steps; ++i) stepper_.do_step(f, x_, 0, scene_.h);
    return peer::seconds_now() - start;
  }

  std::vector<double> positions() const { return {x_.begin(), x_.begin() + 3 * scene_.n}; }

 private:
  using State = std::vector<double>;
  peer::Scene scene_;
  peer::RightHandSide f_;
  State x_;
  boost::numeric::odeint::runge_kutta4<State> stepper_;
};

}  // namespace

int main(int argc, char** argv) { return peer::serve<Odeint>(argc, argv); }
