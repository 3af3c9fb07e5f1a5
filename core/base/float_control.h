// How this thread rounds, and what it traps: as it was before foreign code ran.
#pragma once

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace sim {

// Holds the control words of the vector unit and of the x87; puts them back at the end if they were
// changed (by a library built with -ffast-math, or by fesetround).
class FloatControl {
 public:
  FloatControl() { read(vector_, x87_); }
  ~FloatControl() { restore(); }
  FloatControl(const FloatControl&) = delete;
  FloatControl& operator=(const FloatControl&) = delete;

  void restore() const {
#if defined(__x86_64__)
    unsigned vector;
    unsigned short x87;
    read(vector, x87);
    if ((vector ^ vector_) & kControl) _mm_setcsr(vector_);
    if (x87 != x87_) __asm__ volatile("fldcw %0" : : "m"(x87_));
#endif
  }

 private:
  static constexpr unsigned kControl = ~0x3fU;  // without the flags of what happened

  static void read([[maybe_unused]] unsigned& vector, [[maybe_unused]] unsigned short& x87) {
#if defined(__x86_64__)
    vector = _mm_getcsr();
    __asm__ volatile("fnstcw %0" : "=m"(x87));
#endif
  }

  unsigned vector_ = 0;
  unsigned short x87_ = 0;
};

}  // namespace sim
