// An array of doubles on a cache line, zeroed, of fixed size.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <span>

namespace sim {

class Array {
 public:
  Array() = default;
  explicit Array(std::size_t size)
      : data_(static_cast<double*>(std::aligned_alloc(64, bytes(size)))), size_(size) {
    if (!data_) throw std::bad_alloc();
    std::memset(data_.get(), 0, bytes(size));
  }

  std::size_t size() const noexcept { return size_; }
  double* data() noexcept { return data_.get(); }
  const double* data() const noexcept { return data_.get(); }
  double& operator[](std::size_t i) noexcept { return data_.get()[i]; }
  double operator[](std::size_t i) const noexcept { return data_.get()[i]; }
  std::span<double> span() noexcept { return {data_.get(), size_}; }
  std::span<const double> span() const noexcept { return {data_.get(), size_}; }

 private:
  struct Free {
    void operator()(double* p) const noexcept { std::free(p); }
  };
  // aligned_alloc wants a multiple of the alignment, and something to point at.
  static std::size_t bytes(std::size_t size) { return (size * sizeof(double) / 64 + 1) * 64; }

  std::unique_ptr<double, Free> data_;
  std::size_t size_ = 0;
};

}  // namespace sim
