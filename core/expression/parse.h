// Formulas as people write them: "0.5*k*(r-r0)^2", "4*eps*(s^12-s^6); s = sigma/r".
#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/expression/graph.h"

namespace sim {

// What a text may refer to, and what texts did refer to.
struct Names {
  std::vector<std::string> inputs;        // the variables: name i is input i
  std::map<std::string, double> numbers;  // constants
  std::set<std::string> used = {};        // what texts named of these, added to
};

// Adds the formula to the graph and returns its node. In order of binding:
//   ^ (to the right), unary -, * and /, + and -; parentheses; NAME(a, b) for the functions
//   sqrt exp log sin cos tan sinh cosh tanh abs sign step floor min max pow select(c, a, b);
//   pi; after the formula, each behind a semicolon, NAME = FORMULA for names used before.
// Throws Error{kScene}, with `what` and the column, for anything else, for a text of more than
// 10000 characters or 200 levels of parentheses, and where some part is a constant that is not
// finite.
int parse(std::string_view text, const std::string& what, Names& names, Graph& graph);

}  // namespace sim
