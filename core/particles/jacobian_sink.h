// The sink into which a force adds its Jacobian.
#pragma once

#include "core/math/mat3.h"

namespace sim {

// Adds blocks of 3 x 3.
class JacobianSink {
 public:
  virtual void position(int i, int j, const Mat3& block) = 0;  // += df_i / dx_j, N/m
  virtual void velocity(int i, int j, const Mat3& block) = 0;  // += df_i / dv_j, N s/m

 protected:
  ~JacobianSink() = default;
};

}  // namespace sim
