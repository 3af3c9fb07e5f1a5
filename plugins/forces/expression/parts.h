// Shared by the forces of formulas: on each particle, on ties and on pairs.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/expression/formulas.h"
#include "core/plugin/plugin.h"

namespace sim::expression {

inline constexpr int kBlock = Program::kBlock;

inline const char* const kOwner = "force 'expression'";
inline const std::vector<std::string> kFormulas = {"energy", "fx", "fy", "fz", "cutoff", "skin"};

[[noreturn]] inline void refuse(const std::string& why, const std::string& remedy) {
  throw Error(ErrorKind::kScene, {kOwner, "", why, remedy});
}

using Carried = std::map<std::string, std::vector<double>>;  // see Elements
inline constexpr std::size_t kMostCarried = 8;               // numbers of a particle, and its mass

inline void check_carried(const Carried& carried) {
  if (carried.size() > kMostCarried + 1)
    refuse("its particles carry more than 8 numbers each", "leave out those that it does not read");
}

// The variables of a pair of particles: the numbers carried by each of the two, as charge1 and
// charge2.
class OfBoth {
 public:
  static constexpr std::size_t kMost = 2 * (kMostCarried + 1);

  explicit OfBoth(const Carried& carried) {
    check_carried(carried);
    for (const auto& [name, values] : carried)
      for (const int end : {0, 1}) {
        names_.push_back(name + "12"[end]);
        columns_.push_back({end, values});
      }
  }

  const std::vector<std::string>& names() const { return names_; }
  std::size_t size() const { return columns_.size(); }
  double of(std::size_t column, const std::array<int, 2>& ends) const {
    const auto& [end, values] = columns_[column];
    return values[static_cast<std::size_t>(ends[end])];
  }

 private:
  struct Column {
    int end;
    std::vector<double> values;
  };
  std::vector<std::string> names_;
  std::vector<Column> columns_;
};

// A force along each tie, f_a = -U'(r) d/r with d = x_a - x_b, r = |d|.
std::unique_ptr<Force> make_of_ties(const Params& params, const Elements& ties);
// A force between any two particles, or those closer than the cutoff, f_i = -U'(r) d/r with
// d = x_i - x_j.
std::unique_ptr<Force> make_of_pairs(const Params& params, const Carried& carried);

}  // namespace sim::expression
