// Formulas as people write them: "0.5*k*(r-r0)^2", "4*eps*(s^12-s^6); s = sigma/r".
#pragma once

#include <array>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/expression/graph.h"

namespace sim {

// NAME[-1], NAME[0, 2]: a variable of a cell in a lattice, at another cell. Counted from there.
struct Neighbour {
  int input = 0;
  std::array<int, 3> offset = {};
  bool operator==(const Neighbour&) const = default;
};

// Variables with an index; without directions they have none.
struct CellNames {
  int count = 0;                           // the first inputs, so many
  int directions = 0;                      // numbers in [ ]
  std::array<int, 3> extents = {};         // cells in each direction: neighbours are less far away
  std::vector<Neighbour> neighbours = {};  // that texts named; number i is input inputs.size() + i
};

// The names that a text may refer to, and those that texts referred to.
struct Names {
  std::vector<std::string> inputs;        // the variables: name i is input i
  std::map<std::string, double> numbers;  // constants
  std::set<std::string> used = {};        // those of these names that texts used, added to
  CellNames cells = {};
};

// Adds the formula to the graph and returns its node. In order of binding:
//   ^ (to the right), unary -, * and /, + and -; then one of < <= > >= between two sums, which is 1
//   where it is true and 0 where not; parentheses; NAME(a, b) for the functions
//   sqrt exp log sin cos tan sinh cosh tanh abs sign step floor min max pow
//   if(c, a, b) and select(c, a, b): a where c is not 0, else b;
//   NAME[i, ..], whole numbers, for variables of cells;
//   pi; after the formula, each behind a semicolon, NAME = FORMULA for names used before.
// Throws Error{kScene}, with `what` and the column, for anything else, for a text of more than
// 10000 characters or 200 levels of parentheses, and where some part is a constant that is not
// finite.
int parse(std::string_view text, const std::string& what, Names& names, Graph& graph);

}  // namespace sim
