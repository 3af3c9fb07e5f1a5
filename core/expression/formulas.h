// Formulas among the parameters of a plugin, with the numbers that a scene gives them.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/expression/parse.h"
#include "core/expression/program.h"
#include "core/plugin/params.h"

namespace sim {

// Reads the formulas of one part of a scene. Their variables are what the plugin knows itself,
// then names whose values the scene gives one by one (of ties, say); other names are numbers that
// the scene gives to the part. Every refusal is an Error{kScene} about `owner`.
class Formulas {
 public:
  Formulas(std::string owner, const Params& params, const std::vector<std::string>& known,
           const std::vector<std::string>& own = {}, const CellNames& cells = {});

  // The formula of a parameter of type kText, 0 for one that is not given.
  int read(const std::string& param, const std::string& of);

  // A formula that is part of a longer parameter.
  int parse(const std::string& text, const std::string& of) {
    return sim::parse(text, "bad " + of, names_, graph);
  }

  // Throws for a name that the scene gives and no formula reads. `others`: names it may have meant.
  void check_all_read(const std::vector<std::string>& others) const;

  Program compile(std::span<const int> outputs) const { return Program(graph, outputs, inputs()); }
  // Variables, and then neighbours.
  int inputs() const {
    return static_cast<int>(names_.inputs.size() + names_.cells.neighbours.size());
  }
  const std::vector<Neighbour>& neighbours() const { return names_.cells.neighbours; }

  Graph graph;

 private:
  [[noreturn]] void refuse(const std::string& why, const std::string& remedy) const;

  std::string owner_;
  const Params& params_;
  Names names_;
  std::vector<std::string> given_;
};

// The formula `energy` as U(r), of the distance r of two particles, which is the first variable.
struct RadialEnergy {
  Program energy, slope, slopes;  // U; U'; U' and U''

  RadialEnergy(Formulas& formulas, const std::string& of, const std::vector<std::string>& others);
};

}  // namespace sim
