// The rounding mode and traps of this thread, restored after foreign code.
#pragma once

#include <cstdint>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace sim {

// Holds the control word of the vector unit, and of the x87 where there is one; puts them back at
// the end if they were changed (by a library built with -ffast-math, or by fesetround).
class FloatControl {
 public:
  FloatControl() { read(vector_, x87_); }
  ~FloatControl() { restore(); }
  FloatControl(const FloatControl&) = delete;
  FloatControl& operator=(const FloatControl&) = delete;

  void restore() const {
#if defined(__x86_64__)
    std::uint64_t vector;
    unsigned short x87;
    read(vector, x87);
    if ((vector ^ vector_) & kControl) _mm_setcsr(static_cast<unsigned>(vector_));
    if (x87 != x87_) __asm__ volatile("fldcw %0" : : "m"(x87_));
#elif defined(__aarch64__)
    std::uint64_t vector;
    unsigned short none;
    read(vector, none);
    if (vector != vector_) __asm__ volatile("msr fpcr, %0" : : "r"(vector_));
#endif
  }

 private:
  static constexpr std::uint64_t kControl =
      ~std::uint64_t{0x3f};  // without the flags of what happened

  static void read([[maybe_unused]] std::uint64_t& vector, [[maybe_unused]] unsigned short& x87) {
#if defined(__x86_64__)
    vector = _mm_getcsr();
    __asm__ volatile("fnstcw %0" : "=m"(x87));
#elif defined(__aarch64__)
    __asm__ volatile("mrs %0, fpcr" : "=r"(vector));
#endif
  }

  std::uint64_t vector_ = 0;
  unsigned short x87_ = 0;
};

}  // namespace sim
