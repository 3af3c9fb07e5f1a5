#include "core/particles/springs/net_forces.h"

#include "core/particles/springs/springs.h"

namespace sim {

void add_net_carefully(const Net& net, const double* const q[3], int p, int lanes,
                       double (*sum)[8]) {
  const auto position = [&](int i) { return Vec3(q[0][i], q[1][i], q[2][i]); };
  for (int lane = 0; lane < lanes; ++lane) {
    const int a = net.reordered() ? net.order[static_cast<std::size_t>(p + lane)] : p + lane;
    net.at(a, [&](int b, double k, double rest) {
      const Vec3 d = position(a) - position(b);
      const double s = spring_factor(net.sense, d, k, rest);
      for (int axis = 0; axis < 3; ++axis) sum[axis][lane] = std::fma(s, d[axis], sum[axis][lane]);
    });
  }
}

NetForces::NetForces(std::vector<const Net*> nets, int particles)
    : nets_(std::move(nets)), kernels_(net_kernels()) {
  if (!nets_.empty()) points_ = Array(4 * static_cast<std::size_t>(particles));
  for (const Net* net : nets_) forces_.emplace_back(4 * net->order.size());
}

void NetForces::prepare(const ParticleView& view, ThreadPool& pool) {
  if (nets_.empty()) return;
  pool.run_parts(view.n, 8, [&](int begin, int end) {
    double* point = points_.data() + 4 * static_cast<std::size_t>(begin);
    for (int i = begin; i < end; ++i, point += 4) {
      point[0] = view.x[i];
      point[1] = view.y[i];
      point[2] = view.z[i];
    }
  });
  const double* const q[3] = {view.x, view.y, view.z};
  for (std::size_t j = 0; j < nets_.size(); ++j) {
    const Net& net = *nets_[j];
    if (!net.reordered()) continue;
    pool.run_parts(8 * net.blocks(), 8, [&](int begin, int end) {
      kernels_.pack(net, q, points_.data(), begin, end, forces_[j].data());
    });
  }
}

void NetForces::add(const ParticleView& view, Tile tile, ForceSink sink) const {
  const double* const q[3] = {view.x, view.y, view.z};
  for (std::size_t j = 0; j < nets_.size(); ++j) {
    const Net& net = *nets_[j];
    const Tile used = net.used(tile);
    if (net.reordered())
      kernels_.add_packed(net, forces_[j].data(), used.begin, used.end, sink);
    else
      kernels_.add(net, q, points_.data(), used.begin, used.end, sink);
  }
}

}  // namespace sim
