// An array of numbers on a cache line, zeroed, of fixed size; a large one on huge pages. Nothing is
// allocated in a step: arrays like this take the place of an arena or a pool allocator.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <span>

namespace sim {

// Zeroed memory to be given to free(). Throws std::bad_alloc.
void* zeroed_memory(std::size_t bytes);

template <class Number>
class ArrayOf {
 public:
  ArrayOf() = default;
  explicit ArrayOf(std::size_t size)
      : data_(static_cast<Number*>(zeroed_memory(size * sizeof(Number)))), size_(size) {}

  std::size_t size() const noexcept { return size_; }
  Number* data() noexcept { return data_.get(); }
  const Number* data() const noexcept { return data_.get(); }
  Number& operator[](std::size_t i) noexcept { return data_.get()[i]; }
  const Number& operator[](std::size_t i) const noexcept { return data_.get()[i]; }
  std::span<Number> span() noexcept { return {data_.get(), size_}; }
  std::span<const Number> span() const noexcept { return {data_.get(), size_}; }

 private:
  struct Free {
    void operator()(Number* p) const noexcept { std::free(p); }
  };
  std::unique_ptr<Number, Free> data_;
  std::size_t size_ = 0;
};

using Array = ArrayOf<double>;

}  // namespace sim
