// The elementary functions of the C library with the same bits on every machine: sums, products,
// quotients and square roots alone. Libraries of C differ in theirs, and one library on two
// machines does where it takes fused operations.
//
// Arguments and special results (infinities, not a number, signed zeros) are those of C99, annex F.
// Errors are at most 0.51 ulp, and one ulp where the result is subnormal.
//
// The headers below have faster ones, inline, for loops over particles: e^-x of a damping, x^y, the
// logarithm, sine and cosine of turns. Each states its range and its error.
#pragma once

#include "core/math/exponential.h"
#include "core/math/logarithm.h"
#include "core/math/power.h"
#include "core/math/sine.h"

namespace sim::elementary {

double sin(double x);  // x, and the results of asin, acos, atan2 in radians
double cos(double x);
double tan(double x);
double asin(double x);
double acos(double x);
double atan2(double y, double x);

double exp(double x);
double log(double x);
double log2(double x);
double log10(double x);
double pow(double x, double y);

double sinh(double x);
double cosh(double x);
double tanh(double x);

}  // namespace sim::elementary
