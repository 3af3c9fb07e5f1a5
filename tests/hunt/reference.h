// A reference that shares no method with the program: Gragg's extrapolation.
#pragma once

#include <functional>
#include <span>
#include <vector>

namespace sim_test {

using Rhs = std::function<std::vector<double>(double t, const std::vector<double>& x)>;

// The solution of x' = f(t, x) at each of `times`, from x at t = 0, to a relative tolerance a step,
// by the modified midpoint rule extrapolated in h^2 (Gragg 1965; Bulirsch & Stoer 1966; Deuflhard
// 1985); no step is longer than `longest`. Empty where more than `most` evaluations would be
// needed.
std::vector<std::vector<double>> extrapolated(const Rhs& f, std::vector<double> x,
                                              std::span<const double> times, double tolerance,
                                              double longest, long most);

}  // namespace sim_test
