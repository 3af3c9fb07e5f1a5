#include "core/math/arnoldi.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "core/base/array.h"
#include "core/base/assert.h"

namespace sim {
namespace {

using Complex = std::complex<double>;
using Map = Eigen::Map<Eigen::VectorXd>;

template <class Values>
std::vector<Complex> listed(const Values& values) {
  std::vector<Complex> list(static_cast<std::size_t>(values.size()));
  for (Eigen::Index i = 0; i < values.size(); ++i)
    list[static_cast<std::size_t>(i)] = values.data()[i];
  return list;
}

}  // namespace

struct Arnoldi::Impl {
  Product product;
  std::size_t length;
  int most;
  std::vector<Array> basis;
  Eigen::MatrixXd h;
  int size = 0, products = 0;
  double rest = 0;
  bool ended = false;

  Map vector(int i) {
    return {basis[static_cast<std::size_t>(i)].data(), static_cast<Eigen::Index>(length)};
  }
  auto projection() const { return h.topLeftCorner(size, size); }
};

Arnoldi::Arnoldi(Product product, std::span<const double> start, int most)
    : impl_(new Impl{
          std::move(product),
          start.size(),
          static_cast<int>(std::min<std::size_t>(static_cast<std::size_t>(most), start.size())),
          {},
          {}}) {
  SIM_ASSERT(most > 0 && !start.empty());
  impl_->h = Eigen::MatrixXd::Zero(impl_->most + 1, impl_->most);
  impl_->basis.emplace_back(start.size());
  std::ranges::copy(start, impl_->basis.front().data());
  impl_->vector(0).normalize();
}

Arnoldi::~Arnoldi() = default;

bool Arnoldi::extend() {
  Impl& a = *impl_;
  if (a.ended || a.size == a.most) return false;
  const int k = a.size;
  if (a.basis.size() == static_cast<std::size_t>(k) + 1) a.basis.emplace_back(a.length);
  Map next = a.vector(k + 1);
  a.product(a.vector(k).data(), next.data());
  ++a.products;
  const double before = next.norm();
  if (!next.allFinite()) {
    a.ended = true;
    return false;
  }
  for (int pass = 0; pass < 2; ++pass)  // twice is enough (Parlett 1980)
    for (int i = 0; i <= k; ++i) {
      const double share = a.vector(i).dot(next);
      a.h(i, k) += share;
      next -= share * a.vector(i);
    }
  ++a.size;
  a.rest = next.norm();
  if (a.rest <= 1e-12 * std::max(before, a.h.cwiseAbs().maxCoeff())) {
    a.rest = 0;
    a.ended = true;
    return true;
  }
  a.h(k + 1, k) = a.rest;
  next /= a.rest;
  return true;
}

int Arnoldi::size() const { return impl_->size; }
int Arnoldi::products() const { return impl_->products; }
double Arnoldi::rest() const { return impl_->rest; }

// When S is symmetric so is H, but for rounding.
RitzPairs Arnoldi::pairs() const {
  const Eigen::MatrixXd h = impl_->projection(), transposed = h.transpose();
  if ((h - transposed).norm() <= 1e-6 * h.norm()) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(0.5 * (h + transposed));
    return {listed(solver.eigenvalues()), listed(solver.eigenvectors())};
  }
  const Eigen::EigenSolver<Eigen::MatrixXd> solver(h);
  const Eigen::MatrixXcd vectors = solver.eigenvectors();
  return {listed(solver.eigenvalues()), listed(vectors)};
}

std::vector<Complex> Arnoldi::values() const {
  return listed(Eigen::EigenSolver<Eigen::MatrixXd>(impl_->projection(), false).eigenvalues());
}

std::vector<Complex> Arnoldi::vector(const RitzPairs& pairs, std::size_t i) const {
  const std::size_t k = pairs.values.size();
  SIM_ASSERT(i < k && pairs.coefficients.size() == k * k && k <= impl_->basis.size());
  std::vector<Complex> sum(impl_->length);
  for (std::size_t j = 0; j < k; ++j)
    for (std::size_t row = 0; row < sum.size(); ++row)
      sum[row] += pairs.coefficients[i * k + j] * impl_->basis[j][row];
  return sum;
}

}  // namespace sim
