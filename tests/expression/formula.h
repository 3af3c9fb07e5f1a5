// A formula of x and y, with the numbers k = 3 and c = -0.5, for tests of expressions.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "core/expression/parse.h"
#include "core/expression/program.h"

namespace sim_test {

struct Formula {
  sim::Graph graph;
  sim::Names names{{"x", "y"}, {{"k", 3}, {"c", -0.5}}, {}};
  int node;

  explicit Formula(const std::string& text) : node(sim::parse(text, "bad formula", names, graph)) {}

  // The value of a node at (x, y).
  double at(int id, double x, double y) const {
    double blocks[3][8];
    for (int i = 0; i < 8; ++i) {
      blocks[0][i] = x;
      blocks[1][i] = y;
    }
    const double* const inputs[] = {blocks[0], blocks[1]};
    double* const outputs[] = {blocks[2]};
    sim::Program(graph, {&id, 1}, 2).run(inputs, outputs, 1);
    return blocks[2][0];
  }
  double operator()(double x = 0, double y = 0) const { return at(node, x, y); }
  double slope(int input, double x, double y) {
    const int derivative = graph.derivative(node, input);
    return at(derivative, x, y);
  }
};

}  // namespace sim_test
