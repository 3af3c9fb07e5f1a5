// The design that students are given: the state is a vector of 3-vectors with operators, a function
// returns its derivative as another vector, and Runge-Kutta adds such vectors.
#include "tests/bench/peers/peer.h"

namespace {

struct Vec3 {
  double x = 0, y = 0, z = 0;

  Vec3 operator+(const Vec3& o) const { return {x + o.x, y + o.y, z + o.z}; }
  Vec3 operator-(const Vec3& o) const { return {x - o.x, y - o.y, z - o.z}; }
  Vec3 operator*(double s) const { return {x * s, y * s, z * s}; }
  double length() const { return std::sqrt(x * x + y * y + z * z); }
};

using State = std::vector<Vec3>;  // position and velocity of particle 0, of particle 1, ...

State operator+(const State& a, const State& b) {
  State sum(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) sum[i] = a[i] + b[i];
  return sum;
}

State operator*(const State& a, double s) {
  State product(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) product[i] = a[i] * s;
  return product;
}

class Naive {
 public:
  explicit Naive(peer::Scene scene) : scene_(std::move(scene)) { reset(); }

  std::string about() const { return "vectors of 3-vectors with operator + and *, rk4"; }

  void reset() {
    state_.clear();
    for (std::size_t i = 0; i < scene_.x.size(); i += 3) {
      state_.push_back({scene_.x[i], scene_.x[i + 1], scene_.x[i + 2]});
      state_.push_back({scene_.v[i], scene_.v[i + 1], scene_.v[i + 2]});
    }
  }

  double run(long steps) {
    const double start = peer::seconds_now();
    for (long i = 0; i < steps; ++i) {
      const double h = scene_.h;
      const State k1 = eval(state_);
      const State k2 = eval(state_ + k1 * (h / 2));
      const State k3 = eval(state_ + k2 * (h / 2));
      const State k4 = eval(state_ + k3 * h);
      state_ = state_ + (k1 + k2 * 2 + k3 * 2 + k4) * (h / 6);
    }
    return peer::seconds_now() - start;
  }

  std::vector<double> positions() const {
    std::vector<double> x;
    for (std::size_t i = 0; i < state_.size(); i += 2)
      x.insert(x.end(), {state_[i].x, state_[i].y, state_[i].z});
    return x;
  }

 private:
  State eval(const State& state) const {
    const std::size_t n = state.size() / 2;
    std::vector<Vec3> force(n);
    const Vec3 gravity{scene_.g[0], scene_.g[1], scene_.g[2]};
    for (std::size_t i = 0; i < n; ++i)
      force[i] = gravity * scene_.mass[i] + state[2 * i + 1] * -scene_.drag;
    for (const peer::Spring& s : scene_.springs) {
      const auto a = static_cast<std::size_t>(s.a), b = static_cast<std::size_t>(s.b);
      const Vec3 d = state[2 * a] - state[2 * b];
      const double length = d.length();
      const Vec3 f = d * (-s.k * (length - s.rest) / length);
      force[a] = force[a] + f;
      force[b] = force[b] - f;
    }
    State rate(state.size());
    for (std::size_t i = 0; i < n; ++i) {
      rate[2 * i] = state[2 * i + 1];
      rate[2 * i + 1] = force[i] * (1 / scene_.mass[i]);
    }
    for (const int id : scene_.pinned) rate[2 * static_cast<std::size_t>(id) + 1] = {};
    return rate;
  }

  peer::Scene scene_;
  State state_;
};

}  // namespace

int main(int argc, char** argv) { return peer::serve<Naive>(argc, argv); }
