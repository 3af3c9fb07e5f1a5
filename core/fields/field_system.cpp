#include "core/fields/field_system.h"

#include <algorithm>

#include "core/base/array.h"
#include "core/fields/pair_field.h"
#include "core/ode/implicit/linearisation.h"
#include "core/ode/implicit/sparse_newton.h"

namespace sim {
namespace {

// The entries of the Jacobian that the field knows.
class FieldEntries final : public JacobianEntries {
 public:
  FieldEntries(const Field& field, std::size_t size) : field_(&field), size_(size) {}
  const Sparsity& sparsity() const override { return *field_->sparsity(); }
  void at(double t, const double* x, std::span<double> values) override {
    field_->jacobian(t, {x, size_}, values);
  }

 private:
  const Field* field_;
  std::size_t size_;
};

// Products with the entries.
class FieldJacobian final : public Jacobian {
 public:
  FieldJacobian(const Field& field, std::size_t size)
      : field_(&field), size_(size), values_(field.sparsity()->count()) {}

  void at(double t, const double* x) override { field_->jacobian(t, {x, size_}, values_.span()); }

  void apply(const double* dx, double* df) override {
    const Sparsity& sparsity = *field_->sparsity();
    std::fill_n(df, size_, 0.0);
    for (int column = 0; column < sparsity.size(); ++column)
      for (int k = sparsity.begin_of(column); k < sparsity.end_of(column); ++k)
        df[sparsity.row(k)] += values_[static_cast<std::size_t>(k)] * dx[column];
  }

 private:
  const Field* field_;
  std::size_t size_;
  Array values_;
};

}  // namespace

FieldSystem::FieldSystem(std::span<const double> start, int dimension, std::unique_ptr<Field> field)
    : start_(start.begin(), start.end()),
      size_(start.size()),
      dimension_(dimension),
      field_(std::move(field)) {
  field_->bind(size_, dimension);
  field_->begin(0, start);
}

void FieldSystem::eval(double t, const Stage& stage, double* y, double* dydt) {
  combine(stage, y);
  field_->eval(t, {y, size_}, {dydt, size_});
}

std::unique_ptr<Stepper> FieldSystem::explicit_stepper(const ExplicitPlan& plan) {
  auto stepper = field_->explicit_stepper(plan);
  return stepper ? std::move(stepper) : OdeSystem::explicit_stepper(plan);
}

std::unique_ptr<EmbeddedStepper> FieldSystem::embedded_stepper(const EmbeddedPlan& plan) {
  const auto* const field = dynamic_cast<const PairField*>(field_.get());
  auto stepper = field ? field->embedded_stepper(plan) : nullptr;
  return stepper ? std::move(stepper) : OdeSystem::embedded_stepper(plan);
}

std::unique_ptr<StageSolver> FieldSystem::stage_solver(const StageOptions& options) {
  if (options.solver == StageOptions::Solver::kIterative) return OdeSystem::stage_solver(options);
  std::unique_ptr<JacobianEntries> entries;
  if (field_->sparsity())
    entries = std::make_unique<FieldEntries>(*field_, size_);
  else
    entries = difference_entries(*this, 0, start_.data());
  return std::make_unique<SparseNewton>(*this, options, std::move(entries));
}

std::unique_ptr<LinearisedSolver> FieldSystem::linearised_solver() {
  if (!field_->sparsity()) return OdeSystem::linearised_solver();
  return make_linearised_solver(std::make_unique<FieldEntries>(*field_, size_));
}

std::unique_ptr<Jacobian> FieldSystem::jacobian() {
  if (!field_->sparsity()) return OdeSystem::jacobian();
  return std::make_unique<FieldJacobian>(*field_, size_);
}

}  // namespace sim
