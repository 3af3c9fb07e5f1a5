// The constraints of a system as data.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/particles/constraints/constraint_force.h"
#include "core/particles/constraints/row_values.h"

namespace sim {

struct RowStructure;

class Constraints {
 public:
  using Axes = std::array<double*, 3>;

  // Binds a constraint to the initial state and adds it. feedback: 1/s, see accelerate().
  void add(std::unique_ptr<Constraint> constraint, const std::string& name,
           const std::string& place, double feedback, const ParticleView& initial);
  // Sets the masses, infinite where pinned, of particles that all constraints have been added to,
  // or refreshed; users have to be made again.
  void set_masses(std::span<const double> masses);

  // Reads all patterns again, when ties are broken or mended; set_masses() follows.
  void refresh();

  bool empty() const noexcept { return parts_.empty(); }
  Breakable* breakable(std::size_t part) const { return parts_[part].constraint->breakable(); }
  bool move() const;                                              // some may do work
  double feedback() const noexcept { return feedback_; }          // 1/s; 0: states are projected
  double size() const noexcept { return size_; }                  // m, of the largest coordinate
  std::size_t internal_size() const noexcept { return memory_; }  // in whole cache lines
  std::span<const double> weights() const noexcept { return weights_; }  // 1/kg, 0 where pinned
  const RowList& rows() const noexcept { return rows_; }
  // All users share the structure of their matrices.
  const std::shared_ptr<const RowStructure>& structure() const noexcept { return structure_; }
  const std::string& title(const RowList::Part& part) const;  // "constraint 'distance'"
  const std::string& place(const RowList::Part& part) const;

  void start(double* memory) const;                             // at t = 0
  void follow(const ParticleView& view, double* memory) const;  // memory := that of the positions

  const std::vector<std::string>& notes() const { return notes_; }  // for the user

 private:
  struct Entry {
    std::unique_ptr<Constraint> constraint;
    std::string title, place;
  };
  void append_rows(RowList::Part& part);

  std::vector<Entry> parts_;
  RowList rows_;
  std::shared_ptr<const RowStructure> structure_;
  std::vector<double> weights_;
  std::vector<std::string> notes_;
  double feedback_ = 0, size_ = 0;
  std::size_t memory_ = 0;
};

}  // namespace sim
