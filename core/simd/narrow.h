// Floats in memory that are computed with as doubles, a vector of doubles at a time.
//
// Read once an instruction set, behind core/simd/foreach_target.h.
SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {

typedef float Narrow __attribute__((vector_size(SIM_BITS / 16)));
typedef float NarrowInMemory
    __attribute__((vector_size(SIM_BITS / 16), aligned(sizeof(float)), may_alias));

SIM_INLINE Doubles load_narrow(const float* p) {
  return __builtin_convertvector(*reinterpret_cast<const NarrowInMemory*>(p), Doubles);
}
SIM_INLINE void store_narrow(float* p, Doubles v) {
  *reinterpret_cast<NarrowInMemory*>(p) = __builtin_convertvector(v, Narrow);
}

}  // namespace sim::SIM_TARGET
SIM_TARGET_END
