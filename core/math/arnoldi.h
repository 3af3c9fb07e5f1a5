// The extreme eigenvalues of a matrix given by its products with vectors.
#pragma once

#include <complex>
#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace sim {

// Eigenpairs of the small matrix that represents the large one, in no order.
struct RitzPairs {
  std::vector<std::complex<double>> values;
  std::vector<std::complex<double>> coefficients;  // of the vectors in the basis, one after another

  // The component of vector i along the last member of the basis; with rest() it gives the residual
  // of the pair.
  std::complex<double> last(std::size_t i) const {
    return coefficients[(i + 1) * values.size() - 1];
  }
};

// S Q_k = Q_k H_k + rest q_k+1 e_k^T with orthonormal Q_k: eigenvalues of H_k approach the extreme
// ones of S as k grows. Arnoldi (1951), Quart. Appl. Math. 9, 17-29.
class Arnoldi {
 public:
  using Product = std::function<void(const double* in, double* out)>;  // out := S in

  // From a start vector, not 0; k grows to `most` or to the length of the vector.
  Arnoldi(Product product, std::span<const double> start, int most);
  ~Arnoldi();

  // One product more: k := k + 1. False, then or already, if nothing can be added: k is as large as
  // it may be, the basis is invariant (rest() is 0, the eigenvalues are exact), or a product was
  // not finite, which leaves k as it was.
  bool extend();

  int size() const;  // k
  int products() const;
  double rest() const;  // norm of the residual

  RitzPairs pairs() const;                           // of H_k; symmetric if S is
  std::vector<std::complex<double>> values() const;  // the eigenvalues alone
  std::vector<std::complex<double>> vector(const RitzPairs& pairs, std::size_t i) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sim
