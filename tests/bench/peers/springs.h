// A careful right-hand side for libraries that bring none: X = (x0 y0 z0 x1 ..., v0 ...) and its
// rate.
#pragma once

#include <string>
#include <vector>

#include "tests/bench/peers/peer.h"

namespace peer {

// Sums the spring forces in one of three ways; the constructor times them and keeps the fastest.
class RightHandSide {
 public:
  explicit RightHandSide(const Scene& scene);  // keeps a reference to the scene

  // The way chosen, and what each costs.
  const std::string& about() const { return about_; }

  // dX := f(X), both of 6 n numbers.
  void operator()(const double* X, double* dX) const;

 private:
  void choose_way();

  // Adds the forces at the positions x to f: from one record a spring;
  void add_records(const double* x, double* f) const;
  // from one array a quantity, with indices multiplied beforehand;
  void add_arrays(const double* x, double* f) const;
  // from the same arrays, but first the forces of a block of springs, in a loop that the compiler
  // can turn into vector instructions with gathers, then their sums one by one.
  void add_blocks(const double* x, double* f) const;

  const Scene& scene_;
  std::size_t count_;
  std::vector<double> inverse_mass_, k_, rest_;
  std::vector<int> a_, b_;  // three times the ids
  int way_ = 0;
  std::string about_;
};

}  // namespace peer
