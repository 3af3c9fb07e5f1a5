// A digest of the bits of every elementary function over 200,000 arguments: the same with each
// library of C. Plain C but for the functions themselves, so that it links with a library that has
// no C++.
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "core/math/elementary.h"

namespace {

uint64_t state = 1;

// Numbers of all sizes: of 64 random bits (xorshift64*), exponents cut to `range` on both sides
// of 1.
double number(int range) {
  state ^= state >> 12;
  state ^= state << 25;
  state ^= state >> 27;
  const uint64_t bits = state * UINT64_C(0x2545f4914f6cdd1d);
  const int exponent = static_cast<int>(bits >> 52 & 0x7ff) % (2 * range + 1) - range;
  const uint64_t made =
      (bits & UINT64_C(0x800fffffffffffff)) | static_cast<uint64_t>(exponent + 1023) << 52;
  double x = 0;
  memcpy(&x, &made, sizeof x);
  return x;
}

struct Digest {
  uint64_t sum = UINT64_C(0xcbf29ce484222325);
  void add(double x) {
    uint64_t bits = 0;
    memcpy(&bits, &x, sizeof x);
    if (x != x) bits = UINT64_C(0x7ff8000000000000);  // the sign of a NaN is nobody's
    sum = (sum ^ bits) * UINT64_C(0x100000001b3);
    sum ^= sum >> 29;
  }
};

}  // namespace

int main() {
  namespace own = sim::elementary;
  using Function = double (*)(double);
  constexpr Function kOne[] = {own::sin, own::cos,  own::tan,   own::asin, own::acos, own::exp,
                               own::log, own::log2, own::log10, own::sinh, own::cosh, own::tanh};
  Digest digest;
  for (int i = 0; i < 200000; ++i) {
    const double x = number(i % 4 == 0 ? 1022 : 12), y = number(i % 4 == 1 ? 1022 : 6);
    const double size = x < 0 ? -x : x;
    for (const Function f : kOne) {
      const bool positive = f == own::log || f == own::log2 || f == own::log10;
      digest.add(f(positive ? size : x));
    }
    digest.add(own::atan2(y, x));
    digest.add(own::pow(i % 2 == 0 ? size : x, i % 2 == 0 ? y : static_cast<double>(i % 60 - 30)));
  }
  printf("%016llx\n", static_cast<unsigned long long>(digest.sum));
  return 0;
}
