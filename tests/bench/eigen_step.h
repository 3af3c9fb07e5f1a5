// Linearised steps of backward Euler as anyone would write them with Eigen.
#pragma once

#include <Eigen/Dense>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/scene/simulation.h"

namespace sim_bench {

// (M + h^2 K) dv = h (F - h K v) of a cloth that hangs by its first two corners, assembled into a
// pattern that is made once; pinned particles have no rows. Springs that push do not do so across
// their length.
class EigenStep {
 public:
  using Matrix = Eigen::SparseMatrix<double>;

  // mass: kg a particle; h: s.
  EigenStep(const sim::Simulation& scene, double mass, double h) : mass_(mass), h_(h) {
    const auto of_eigen = [](const sim::Vec3& v) { return Eigen::Vector3d(v.x(), v.y(), v.z()); };
    int rows = 0;
    for (int i = 0; i < scene.particles(); ++i) {
      x_.push_back(of_eigen(scene.position(i)));
      v_.push_back(of_eigen(scene.velocity(i)));
      for (const sim::Link& link : scene.links(i))
        if (link.to > i) springs_.push_back({i, link.to, link.stiffness, link.rest, {}});
    }
    const int side = static_cast<int>(std::lround(std::sqrt(scene.particles())));
    for (int i = 0; i < scene.particles(); ++i)
      row_.push_back(i == 0 || i == side - 1 ? -1 : 3 * rows++);
    std::vector<Eigen::Triplet<double>> entries;
    const auto add = [&](int row, int col) {
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) entries.emplace_back(row + r, col + c, 0.0);
    };
    for (const int row : row_)
      if (row >= 0) add(row, row);
    for (const Spring& s : springs_)
      if (row_[s.a] >= 0 && row_[s.b] >= 0) {
        add(row_[s.a], row_[s.b]);
        add(row_[s.b], row_[s.a]);
      }
    matrix_.resize(3 * rows, 3 * rows);
    matrix_.setFromTriplets(entries.begin(), entries.end());
    for (Spring& s : springs_) {
      const int ends[2] = {row_[s.a], row_[s.b]};
      for (int e = 0; e < 4; ++e)
        for (int col = 0; col < 3; ++col)
          s.at[e][col] = ends[e % 2] < 0 ? 0 : entry(ends[e / 2], ends[e % 2] + col);
    }
    for (const int row : row_)
      for (int col = 0; row >= 0 && col < 3; ++col)
        diagonal_.push_back(entry(row, row + col) + col);
    rhs_.setZero(3 * rows);
    dv_.setZero(3 * rows);
    start_ = x_;
  }

  void reset() {  // at rest where the scene was
    x_ = start_;
    for (Eigen::Vector3d& v : v_) v.setZero();
  }

  template <class Solve>
  void step(const Solve& solve) {
    const double h = h_;
    std::fill_n(matrix_.valuePtr(), matrix_.nonZeros(), 0.0);
    for (const int at : diagonal_) matrix_.valuePtr()[at] = mass_;
    for (std::size_t i = 0; i < x_.size(); ++i)
      if (row_[i] >= 0) rhs_.segment<3>(row_[i]) = Eigen::Vector3d(0, -9.81 * mass_ * h, 0);
    for (const Spring& s : springs_) {
      const Eigen::Vector3d d = x_[s.a] - x_[s.b];
      const double length = d.norm();
      const Eigen::Vector3d u = d / length;
      const double along = std::max(0.0, s.k * (1 - s.rest / length));
      const Eigen::Matrix3d k =
          along * Eigen::Matrix3d::Identity() + (s.k - along) * u * u.transpose();
      const Eigen::Vector3d push =
          -h * (s.k * (length - s.rest) * u + h * (k * (v_[s.a] - v_[s.b])));
      const int ends[2] = {row_[s.a], row_[s.b]};
      if (ends[0] >= 0) rhs_.segment<3>(ends[0]) += push;
      if (ends[1] >= 0) rhs_.segment<3>(ends[1]) -= push;
      for (int e = 0; e < 4; ++e)
        if (ends[e / 2] >= 0 && ends[e % 2] >= 0)
          for (int col = 0; col < 3; ++col)
            for (int row = 0; row < 3; ++row)
              matrix_.valuePtr()[s.at[e][col] + row] += (e % 3 == 0 ? h * h : -h * h) * k(row, col);
    }
    solve(matrix_, rhs_, dv_);
    for (std::size_t i = 0; i < x_.size(); ++i) {
      if (row_[i] < 0) continue;
      v_[i] += dv_.segment<3>(row_[i]);
      x_[i] += h * v_[i];
    }
  }

  const Matrix& matrix() const { return matrix_; }
  // |rhs - A dv| / |rhs| of the last step.
  double residual() const { return (rhs_ - matrix_ * dv_).norm() / rhs_.norm(); }

 private:
  struct Spring {
    int a, b;
    double k, rest;
    int at[4][3];  // where its columns begin in the values: aa, ab, ba, bb
  };

  int entry(int row, int col) const {
    if (row < 0) return 0;
    const int* const inner = matrix_.innerIndexPtr();
    const int* const begin = inner + matrix_.outerIndexPtr()[col];
    const int* const end = inner + matrix_.outerIndexPtr()[col + 1];
    return static_cast<int>(std::lower_bound(begin, end, row) - inner);
  }

  double mass_, h_;
  std::vector<Eigen::Vector3d> x_, v_, start_;
  std::vector<Spring> springs_;
  std::vector<int> row_, diagonal_;
  Matrix matrix_;
  Eigen::VectorXd rhs_, dv_;
};

}  // namespace sim_bench
