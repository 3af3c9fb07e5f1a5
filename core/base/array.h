// An array of numbers on a cache line, zeroed, of fixed size.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <span>

namespace sim {

template <class Number>
class ArrayOf {
 public:
  ArrayOf() = default;
  explicit ArrayOf(std::size_t size)
      : data_(static_cast<Number*>(std::aligned_alloc(64, bytes(size)))), size_(size) {
    if (!data_) throw std::bad_alloc();
    std::memset(data_.get(), 0, bytes(size));
  }

  std::size_t size() const noexcept { return size_; }
  Number* data() noexcept { return data_.get(); }
  const Number* data() const noexcept { return data_.get(); }
  Number& operator[](std::size_t i) noexcept { return data_.get()[i]; }
  Number operator[](std::size_t i) const noexcept { return data_.get()[i]; }
  std::span<Number> span() noexcept { return {data_.get(), size_}; }
  std::span<const Number> span() const noexcept { return {data_.get(), size_}; }

 private:
  struct Free {
    void operator()(Number* p) const noexcept { std::free(p); }
  };
  // aligned_alloc wants a multiple of the alignment, and something to point at.
  static std::size_t bytes(std::size_t size) { return (size * sizeof(Number) / 64 + 1) * 64; }

  std::unique_ptr<Number, Free> data_;
  std::size_t size_ = 0;
};

using Array = ArrayOf<double>;

}  // namespace sim
