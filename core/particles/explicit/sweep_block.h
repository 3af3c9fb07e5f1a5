// Blocks of particles as sweeps take them: vectors of numbers, and positions.
//
// Read once an instruction set, behind core/simd/foreach_target.h.
SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

// A block of kBlock<Real> particles, whatever the vector width: the data of a run is looked up once
// for all of them.
inline constexpr int kVectors = 512 / SIM_BITS;

template <class Real>
struct Numbers {
  V<Real> of[kVectors];
};
template <class Real>
SIM_INLINE Numbers<Real> load_block(const Real* from) {
  Numbers<Real> v;
  for (int h = 0; h < kVectors; ++h) v.of[h] = load(from + h * kLanes<Real>);
  return v;
}
template <class Real>
SIM_INLINE void store_block(Real* to, const Numbers<Real>& v) {
  for (int h = 0; h < kVectors; ++h) store(to + h * kLanes<Real>, v.of[h]);
}

template <class Real>
struct Points {
  V3<Real> of[kVectors];
};

// The positions of particles from `begin` on, by pointers that no store can change.
template <class Real>
struct Positions {
  const Real *x, *y, *z;

  SIM_INLINE explicit Positions(const Real* const q[3], std::int64_t begin = 0)
      : x(q[0] + begin), y(q[1] + begin), z(q[2] + begin) {}
  // The positions of vector h of the block from i on.
  SIM_INLINE V3<Real> at(std::int64_t i, int h) const {
    return {load(x + i + h * kLanes<Real>), load(y + i + h * kLanes<Real>),
            load(z + i + h * kLanes<Real>)};
  }
  SIM_INLINE Points<Real> block(std::int64_t i) const {
    Points<Real> points;
    for (int h = 0; h < kVectors; ++h) points.of[h] = at(i, h);
    return points;
  }
};

// The positions of the block, the first one of q: in registers, or loaded at each use if it takes
// so many that they would be spilled.
template <class Real>
class Here {
 public:
  SIM_INLINE explicit Here(const Positions<Real>& q) : q_(&q), first_(q.at(0, 0)) {}
  SIM_INLINE V3<Real> at(int h) const { return kVectors == 1 ? first_ : q_->at(0, h); }

 private:
  const Positions<Real>* q_;
  V3<Real> first_;
};

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END
