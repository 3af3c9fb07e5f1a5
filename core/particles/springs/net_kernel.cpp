#include "core/particles/springs/net_forces.h"
#include "core/particles/springs/springs.h"
#include "core/simd/inverse_sqrt.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "core/particles/springs/net_kernel.cpp"
#include "core/simd/foreach_target.h"

#include "core/particles/springs/spring_kernel.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

// The other ends of a slot, with all that does not depend on the constants of the springs.
struct Seeded {
  V3<double> d;
  Doubles dd, r;  // |d|^2, and the seed of 1/|d|
};

SIM_INLINE Seeded seeded(const double* points, const std::int32_t* to, const V3<double>& here) {
  const V3<double> d = here - gather(points, to);
  const Doubles dd = squared(d);
  return {d, dd, seed(dd)};
}

// The constants of the springs; dd = |d|^2 decides whether springs of one sense are slack.
SIM_INLINE Constants<double> constants(const Net& net, const Net::Slot& slot, int half,
                                       Doubles dd) {
  if (slot.kind >= 0) [[likely]]
    return {splat<double>(net.kind_of(slot).k), splat<double>(net.kind_of(slot).k_rest)};
  const Doubles rest = load(net.rests.data() + slot.own() + half);
  const Doubles k =
      taut_stiffness<double>(net.sense, load(net.ks.data() + slot.own() + half), rest, dd);
  return {k, k * rest};
}

// The forces of a net on the particles at `lanes` places from p.
SIM_INLINE V3<double> net_block(const Net& net, const double* const q[3], const double* points,
                                int p, int lanes, const V3<double>& here) {
  constexpr unsigned kAll = (1u << kDoubles) - 1;
  const int half = p & 7;
  const Net::Slot* slot = net.slots.data() + net.first[p >> 3];
  const Net::Slot* const end = net.slots.data() + net.first[(p >> 3) + 1];
  V3<double> sum{};
  if (slot == end) return sum;
  Doubles errors{};
  // The loads and the seed of the next slot go before the sums of this one: a processor that waits
  // for a square root and a division has no room for the instructions of many slots.
  Seeded next = seeded(points, slot->to + half, here);
  for (; slot != end; ++slot) {
    const Seeded now = next;
    if (slot + 1 != end) next = seeded(points, slot[1].to + half, here);
    const Constants<double> spring = constants(net, *slot, half, now.dd);
    const unsigned bits = slot->present >> half & kAll;
    add_scaled(spring_factors(now.dd, now.r, spring, bits, errors), now.d, sum);
  }
  if (needs_care(errors, sum)) {
    double block[3][8] = {};
    add_net_carefully(net, q, p, lanes, block);
    sum = {load(block[0]), load(block[1]), load(block[2])};
  }
  return sum;
}

SIM_INLINE void add_to(ForceSink sink, int i, const V3<double>& force) {
  store(sink.x + i, load(sink.x + i) + force.x);
  store(sink.y + i, load(sink.y + i) + force.y);
  store(sink.z + i, load(sink.z + i) + force.z);
}

void add_net(const Net& net, const double* const q[3], const double* points, int begin, int end,
             ForceSink sink) {
  for (int i = begin; i < end; i += kDoubles)
    add_to(sink, i,
           net_block(net, q, points, i, i + kDoubles < end ? kDoubles : end - i, load(q, i)));
}

void pack_net(const Net& net, const double* const q[3], const double* points, int begin, int end,
              double* forces) {
  for (int p = begin; p < end; p += kDoubles) {
    const V3<double> here = gather(points, net.order.data() + p);
    const V3<double> sum = net_block(net, q, points, p, kDoubles, here);
    double block[3][8];
    store(block[0], sum.x);
    store(block[1], sum.y);
    store(block[2], sum.z);
    double* force = forces + 4 * std::ptrdiff_t{p};
    for (int lane = 0; lane < kDoubles; ++lane, force += 4)
      for (int axis = 0; axis < 3; ++axis) force[axis] = block[axis][lane];
  }
}

void add_packed(const Net& net, const double* forces, int begin, int end, ForceSink sink) {
  for (int i = begin; i < end; i += kDoubles) add_to(sink, i, gather(forces, net.place.data() + i));
}

constexpr NetKernels kNet{add_net, pack_net, add_packed};

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

NetKernels net_kernels() { return SIM_CHOOSE(kNet); }

}  // namespace sim
#endif
