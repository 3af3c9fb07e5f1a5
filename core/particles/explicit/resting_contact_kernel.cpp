#include "core/particles/explicit/resting_contact_kernel.h"
#include "core/particles/step_path.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "core/particles/explicit/resting_contact_kernel.cpp"
#include "core/simd/foreach_target.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

// All sums and products are in the order of Vec3 and StepPath and never fused, so that the results
// have the bits of Contacts.
using Point = V3<double>;
constexpr int kLying = 8;   // particles of an entry
constexpr int kRounds = 4;  // of iterations; particles that need more go to Contacts

SIM_INLINE Doubles number(double s) { return splat<double>(s); }
SIM_INLINE Doubles choose(Mask m, Doubles a, Doubles b) { return m ? a : b; }
SIM_INLINE Point choose(Mask m, const Point& a, const Point& b) {
  return {choose(m, a.x, b.x), choose(m, a.y, b.y), choose(m, a.z, b.z)};
}
SIM_INLINE Point operator+(const Point& a, const Point& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
SIM_INLINE Point operator*(Doubles s, const Point& a) { return {a.x * s, a.y * s, a.z * s}; }
SIM_INLINE Doubles dot(const Point& a, const Point& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
SIM_INLINE Doubles norm(const Point& a) { return square_root(dot(a, a)); }
SIM_INLINE Doubles size(Doubles v) { return v < Doubles{} ? -v : v; }
SIM_INLINE Doubles larger(Doubles a, Doubles b) { return a < b ? b : a; }  // std::max
SIM_INLINE Point all(const Vec3& v) { return {number(v[0]), number(v[1]), number(v[2])}; }
SIM_INLINE Doubles slack(const Point& x) {
  return number(1e-12) * larger(number(1), larger(larger(size(x.x), size(x.y)), size(x.z)));
}
SIM_INLINE void keep_as(double* const to[3], std::int64_t i, Mask m, const Point& v) {
  const Point now = choose(m, v, load(to, i));
  store(to[0] + i, now.x);
  store(to[1] + i, now.y);
  store(to[2] + i, now.z);
}
// The lanes whose bits are set.
SIM_INLINE Mask mask_of(unsigned bits) { return keep(bits, number(1)) > Doubles{}; }

struct Seen {
  Doubles gap;
  Point normal;
};

// The surface as SdfCollider::query() sees it.
template <PrimitiveSurface::Form kForm>
struct Surface {
  Point center, velocity, normal;
  Doubles radius, thickness, sign;

  SIM_INLINE explicit Surface(const PrimitiveSurface& from)
      : center(all(from.center)),
        velocity(all(from.velocity)),
        normal(all(from.normal)),
        radius(number(from.radius)),
        thickness(number(from.thickness)),
        sign(number(from.inside ? -1 : 1)) {}

  SIM_INLINE Doubles gap(const Point& x) const {
    const Point d = x - center;
    const Doubles from = kForm == PrimitiveSurface::Form::kPlane ? dot(normal, d) : norm(d);
    return sign * (from - radius) - thickness;
  }
  SIM_INLINE Seen query(const Point& x) const {
    const Point d = x - center;
    if constexpr (kForm == PrimitiveSurface::Form::kPlane)
      return {sign * (dot(normal, d) - radius) - thickness, sign * normal};
    const Doubles length = norm(d), zero{};
    const Mask off = length > zero;
    const Point outward = {d.x / length, d.y / length, d.z / length};
    return {sign * (length - radius) - thickness,
            sign * choose(off, outward, {zero, number(1), zero})};
  }
};

// The paths of the lanes, as StepPath.
struct Ways {
  Point c[4], moved, velocity_change;

  SIM_INLINE Point end() const { return c[0] + (c[1] + (c[2] + c[3])); }
  SIM_INLINE Point rate_at_start() const {
    const Doubles zero{};
    return c[1] + zero * (number(2) * c[2] + zero * c[3]);
  }
  SIM_INLINE Point rate_at_end() const { return c[1] + (number(2) * c[2] + number(3) * c[3]); }
  SIM_INLINE Doubles length() const {
    return norm(c[1]) + number(2) * norm(c[2]) + number(3) * norm(c[3]);
  }
  // Changes the velocities from the start of the path on, in the lanes m.
  SIM_INLINE void kick(Mask m, const Point& change) {
    c[0] = choose(m, c[0] - Doubles{} * change, c[0]);
    c[1] = choose(m, c[1] + change, c[1]);
    moved = choose(m, moved + change, moved);
    velocity_change = choose(m, velocity_change + change, velocity_change);
  }
  SIM_INLINE void press(Mask m, const Point& acceleration) {
    const Point half = number(0.5) * acceleration;
    c[2] = choose(m, c[2] + half, c[2]);
    moved = choose(m, moved + half, moved);
    velocity_change = choose(m, velocity_change + half, velocity_change);
  }
  SIM_INLINE void shift(Mask m, const Point& by) {
    c[0] = choose(m, c[0] + by, c[0]);
    moved = choose(m, moved + by, moved);
  }
};

SIM_INLINE Ways ways_of(const RestingContactStep& step, int i) {
  const Doubles h = number(step.h);
  const Point x0 = load(step.q0, i), x1 = load(step.q, i), r0 = h * load(step.v0, i), none{};
  if (!step.whole) return {{x0, r0, x1 - x0 - r0, none}, none, none};
  const Point r1 = h * load(step.v, i), d = x1 - x0;
  return {{x0, r0, number(3) * d - number(2) * r0 - r1, r0 + r1 - number(2) * d}, none, none};
}

// Contacts::constrain_velocity() for one surface: returns the velocities of the lanes m. Lanes
// whose iteration does not converge are removed from m.
template <PrimitiveSurface::Form kForm>
SIM_INLINE Point held(const Surface<kForm>& surface, double friction, const Point& x, Point v,
                      Mask& m, Doubles& lost, Doubles& given) {
  const Doubles zero{}, mu = number(friction);
  const Seen seen = surface.query(x);
  const Doubles carried = norm(surface.velocity);
  Mask inward = m & (seen.gap <= slack(x));
  for (int round = 0; round < kRounds; ++round) {
    const Point relative = v - surface.velocity;
    const Doubles normal = dot(relative, seen.normal);
    inward &= normal < zero;
    if (!bits_of(inward)) return v;
    const Point across = normal * seen.normal, slip = relative - across;
    const Doubles speed = norm(slip), most = -normal * mu;
    Point next = v - (across + zero * slip);
    if (friction > 0) {
      const Mask sticks = (most > zero) & (speed <= most);
      next = v - (across + choose(most > zero, most / speed, zero) * slip);
      next = choose(sticks, surface.velocity, next);
    }
    const Point change = next - v;
    given = choose(inward, given + dot(change, surface.velocity), given);
    lost = choose(inward, lost + dot(change, surface.velocity - number(0.5) * (v + next)), lost);
    v = choose(inward, next, v);
    inward &= -normal > number(1e-15) * (speed + carried);
  }
  m &= ~inward;
  return v;
}

// The resting contact of Hold, through the whole step.
template <PrimitiveSurface::Form kForm>
struct Press {
  const RestingContactStep& step;
  const Surface<kForm>& before;
  const Surface<kForm>& after;
  Seen start;
  Seen end;  // the surface at the former end of the path
  Mask sticking = {};
  Point place = {};  // of sticking lanes

  // Presses the lanes m onto the surface; lanes that reverse within the step are removed from
  // `known`.
  SIM_INLINE void press(Mask m, Ways& path, Mask& known) {
    const Doubles zero{}, least = number(0.1);
    if (step.friction == 0) return along(m, start.normal, path);
    const Doubles mu = number(step.friction), h = number(step.h);
    const Point rate = path.rate_at_start(), surface = h * before.velocity;
    const auto tangential = [&](const Point& v) __attribute__((always_inline)) {
      return v - dot(v, start.normal) * start.normal;
    };
    const Point slip = tangential(rate - surface);
    const Point drive = tangential(path.rate_at_end() - rate - (h * after.velocity - surface));
    Doubles speed = norm(slip);
    speed = speed <= number(1e-14) * (norm(rate) + norm(surface)) ? zero : speed;
    const Doubles pressure =
        larger(zero, number(-2) * end.gap / larger(dot(start.normal, end.normal), least));
    const Mask moves = speed != zero;
    const Doubles along_slip = dot(drive, slip) / speed;
    const Mask slides = m & moves & (speed + (along_slip - mu * pressure) >= zero);
    if (bits_of(slides)) along(slides, start.normal - (mu / speed) * slip, path);

    const Mask stops = m & ~slides;
    if (!bits_of(stops)) return;
    const Doubles braking = mu * pressure;
    known &= ~(stops & ~(norm(drive) <= braking));
    const Doubles time = speed / (braking - along_slip);
    place = way_at_start(path);
    if (step.moves) place = place + (after.center - before.center);
    place = place + choose(moves, number(0.5) * time * slip, Point{});
    const Seen there = after.query(place);
    const Point out = there.gap * there.normal;
    place = choose(size(there.gap) > slack(place), place - out, place);
    path.press(stops, number(2) * (place - path.end()));
    sticking = stops;
  }

 private:
  SIM_INLINE static Point way_at_start(const Ways& path) {
    const Doubles zero{};
    return path.c[0] + zero * (path.c[1] + zero * (path.c[2] + zero * path.c[3]));
  }
  SIM_INLINE void along(Mask m, const Point& direction, Ways& path) {
    constexpr int kIterations = 8;  // of Hold
    Seen now = end;
    for (int n = 0; n < kIterations; ++n) {
      const Doubles share = larger(dot(direction, now.normal), number(0.1));
      path.press(m, (number(-2) * now.gap / share) * direction);
      const Point there = path.end();
      now = after.query(there);
      m &= ~(size(now.gap) <= number(0.1) * slack(there));
      if (!bits_of(m)) return;
    }
  }
};

// Resolves the contacts of the lanes whose bits are set in `free`, from particle i on.
template <PrimitiveSurface::Form kForm>
SIM_INLINE void resolve_lanes(const RestingContactStep& step, const Surface<kForm>& before,
                              const Surface<kForm>& after, int i, unsigned free, int lane,
                              RestingContactBlock& block) {
  const Doubles zero{}, h = number(step.h);
  Ways path = ways_of(step, i);
  const Point x0 = path.c[0], x1 = load(step.q, i);
  const Doubles near_start = slack(x0);
  Press<kForm> press{step, before, after, before.query(x0), after.query(path.end())};
  const Point surface = h * before.velocity, rate = path.rate_at_start();
  const Doubles clear = after.gap(x1), inward = dot(rate - surface, press.start.normal);
  Mask known = mask_of(free) & (press.start.gap <= near_start) & (press.start.gap >= -near_start) &
               (clear <= zero) & (press.end.gap < zero) &
               (inward <= number(-kMinFlightTime) * press.end.gap);
  const unsigned moves_in = bits_of(known);
  if (moves_in != free) {  // others may come near nothing
    const Mask far = clear > path.length() + number(step.reach);
    block.known |= (free & ~moves_in & bits_of(far)) << lane;
  }
  if (!moves_in) return;

  // The impact, as in bounce().
  Doubles given = zero, lost = zero;
  Point blow{};
  if (const Mask hits = known & (inward < zero); bits_of(hits)) {
    const Doubles push = number(-(1 + step.restitution)) * inward;
    blow = push * press.start.normal;
    if (step.friction > 0) {
      const Point slip = rate - surface - inward * press.start.normal;
      const Doubles speed = norm(slip), most = number(step.friction) * push;
      blow = blow - choose(speed <= most, slip, (most / speed) * slip);
    }
    path.kick(hits, blow);
    given = choose(hits, dot(blow, surface), zero);
    lost = choose(hits, dot(blow, surface - rate - number(0.5) * blow), zero);
    press.end = after.query(path.end());
    // Lanes that fly and return go on to bounce, see bounce_until_rest().
    if (!step.once) {
      const Doubles leaving = dot(path.rate_at_start() - surface, press.start.normal);
      known &= ~(hits & (press.end.gap < zero) &
                 (leaving >= number(kShortestFlight) * (leaving - press.end.gap)));
    }
  }

  // Lanes that end inside are resting contacts; what rounding leaves inside is pushed out.
  Mask resting = known & (press.end.gap < zero);
  if (bits_of(resting)) {
    const Point velocity_change = path.velocity_change, moved = path.moved,
                end_rate = path.rate_at_end();
    const Point free_change = end_rate - path.rate_at_start();
    press.press(resting, path, known);
    const Point kick = path.velocity_change - velocity_change;
    const Doubles gain =
        dot(kick, end_rate + number(0.5) * kick) - dot(free_change, path.moved - moved);
    given = choose(resting, given + dot(kick, surface), given);
    lost = choose(resting, lost + (dot(kick, surface) - gain), lost);
  }
  Mask inside = known;
  for (int round = 0; round <= kRounds; ++round) {
    const Seen seen = after.query(choose(press.sticking, press.place, path.end()));
    inside &= seen.gap < zero;
    if (!bits_of(inside)) break;
    const Point out = -seen.gap * seen.normal;
    path.shift(inside, out);
    press.place = choose(inside, press.place + out, press.place);
    resting |= inside;
  }
  known &= ~inside;
  if (step.room < HUGE_VAL) {  // a path that changes more may meet another surface
    const Point rest = path.moved - blow;
    const Doubles most = number(0.25 * step.room * step.room);
    known &= (dot(blow, blow) < most) & (dot(rest, rest) < most);
  }

  const Point place = choose(press.sticking, press.place, x1 + path.moved);
  const Point by = {path.velocity_change.x / h, path.velocity_change.y / h,
                    path.velocity_change.z / h};
  Point velocity = load(step.v, i) + by;
  Doubles lost_velocity = zero, given_velocity = zero;
  if (step.whole) {
    Mask holds = known & resting;
    const Mask asked = holds;
    velocity = held(after, step.friction, place, velocity, holds, lost_velocity, given_velocity);
    known &= ~(asked & ~holds);
  }
  keep_as(step.q, i, known, place);
  keep_as(step.v, i, known, velocity);
  store(block.lost + lane, lost);
  store(block.given + lane, given);
  store(block.lost_velocity + lane, lost_velocity);
  store(block.given_velocity + lane, given_velocity);
  const unsigned done = bits_of(known);
  block.known |= done << lane;
  block.met |= done << lane;
  block.resting |= (done & bits_of(resting)) << lane;
}

template <PrimitiveSurface::Form kForm>
void resolve_all(const RestingContactStep& step, int begin, int end, RestingContactBlock* block) {
  const Surface<kForm> before(step.before), after(step.after);
  for (int i = begin; i < end; i += kLying, ++block) {
    unsigned bits = step.free[i >> 3];
    if (end - i < kLying) bits &= (1u << (end - i)) - 1;
    block->known = 0xff & ~bits;
    block->met = block->resting = 0;
    for (int lane = 0; lane < kLying; lane += kDoubles)
      if (const unsigned free = bits >> lane & ((1u << kDoubles) - 1))
        resolve_lanes(step, before, after, i + lane, free, lane, *block);
  }
}

void resolve_resting(const RestingContactStep& step, int begin, int end,
                     RestingContactBlock* block) {
  if (step.after.form == PrimitiveSurface::Form::kPlane)
    resolve_all<PrimitiveSurface::Form::kPlane>(step, begin, end, block);
  else
    resolve_all<PrimitiveSurface::Form::kSphere>(step, begin, end, block);
}

// Replaces the velocities by those that the contact allows, and books the work.
template <PrimitiveSurface::Form kForm>
bool constrain_all(const RestingContactKick& kick, int begin, unsigned bits,
                   RestingContactBlock& block) {
  const Surface<kForm> surface(kick.surface);
  Point velocity[kLying / kDoubles];
  Mask lanes[kLying / kDoubles];
  for (int n = 0; n < kLying / kDoubles; ++n) {
    const int i = begin + n * kDoubles;
    Doubles lost{}, given{};
    lanes[n] = mask_of(bits >> n * kDoubles);
    Mask done = lanes[n];
    velocity[n] = held(surface, kick.friction, load(kick.q, i), load(kick.v, i), done, lost, given);
    if (bits_of(lanes[n] & ~done)) return false;
    store(block.lost_velocity + n * kDoubles, lost);
    store(block.given_velocity + n * kDoubles, given);
  }
  for (int n = 0; n < kLying / kDoubles; ++n) {
    const int i = begin + n * kDoubles;
    keep_as(kick.v, i, lanes[n], velocity[n]);
    if (!kick.a[0]) continue;
    const Doubles keep_v = kick.next.keeps ? load(kick.next.keeps + i) : number(kick.next.keep);
    const Doubles gain = kick.next.keeps ? load(kick.next.gains + i) : number(kick.next.gain);
    const Point a = load(kick.a, i), kept = keep_v * velocity[n];
    const Point next = {fma(gain, a.x, kept.x), fma(gain, a.y, kept.y), fma(gain, a.z, kept.z)};
    keep_as(kick.v_after, i, lanes[n], next);
    if (!kick.q_next[0]) continue;
    const Doubles drift = number(kick.drift);
    const Point q = load(kick.q, i);
    keep_as(kick.q_next, i, lanes[n],
            {fma(drift, next.x, q.x), fma(drift, next.y, q.y), fma(drift, next.z, q.z)});
  }
  return true;
}

bool constrain_resting(const RestingContactKick& kick, int i, unsigned bits,
                       RestingContactBlock& block) {
  return kick.surface.form == PrimitiveSurface::Form::kPlane
             ? constrain_all<PrimitiveSurface::Form::kPlane>(kick, i, bits, block)
             : constrain_all<PrimitiveSurface::Form::kSphere>(kick, i, bits, block);
}

constexpr RestingContactKernels kKernels{resolve_resting, constrain_resting};

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

RestingContactKernels resting_contact_kernels() { return SIM_CHOOSE(kKernels); }

}  // namespace sim
#endif
