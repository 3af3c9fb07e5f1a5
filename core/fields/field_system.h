// A first-order system X' = f(t, X) whose right-hand side is a field; the state is a plain list.
#pragma once

#include <memory>

#include "core/fields/field.h"
#include "core/ode/ode_system.h"

namespace sim {

class FieldSystem final : public OdeSystem {
 public:
  FieldSystem(std::size_t size, int dimension, std::unique_ptr<Field> field)
      : size_(size), dimension_(dimension), field_(std::move(field)) {
    field_->bind(size, dimension);
  }

  std::size_t size() const noexcept override { return size_; }
  StateShape shape() const override {
    return dimension_ == 3 ? StateShape::points(size_ / 3) : StateShape::flat(size_);
  }

  void eval(double t, const Stage& stage, double* y, double* dydt) override {
    combine(stage, y);
    field_->eval(t, {y, size_}, {dydt, size_});
  }

  void combine(const Stage& stage, double* out) override { combine_range_(stage, out, 0, size_); }

 private:
  std::size_t size_;
  int dimension_;
  CombineRange combine_range_ = combine_range();
  std::unique_ptr<Field> field_;
};

}  // namespace sim
