#include "core/expression/formulas.h"

#include <algorithm>

#include "core/base/error.h"
#include "core/base/text.h"

namespace sim {

Formulas::Formulas(std::string owner, const Params& params, const std::vector<std::string>& known,
                   const std::vector<std::string>& own, const CellNames& cells)
    : owner_(std::move(owner)),
      params_(params),
      names_{known, params.free_numbers(), {}, cells},
      given_(own) {
  names_.inputs.insert(names_.inputs.end(), own.begin(), own.end());
  for (const std::string& name : own) names_.numbers.erase(name);
  for (const auto& entry : names_.numbers) given_.push_back(entry.first);
  for (const std::string& name : given_)
    if (std::ranges::count(known, name))
      refuse("'" + name + "' is a variable of it already", "give the number another name");
}

int Formulas::read(const std::string& param, const std::string& of) {
  if (!params_.has(param)) return graph.number(0);
  return parse(params_.text(param), param + " of " + of);
}

void Formulas::check_all_read(const std::vector<std::string>& others) const {
  std::vector<std::string> known(names_.used.begin(), names_.used.end());
  known.insert(known.end(), others.begin(), others.end());
  for (const std::string& name : given_)
    if (!names_.used.contains(name)) {
      const std::string near = nearest(name, known);
      refuse("no formula of it reads '" + name + "'",
             near.empty() ? "leave it out" : "did you mean '" + near + "'?");
    }
}

void Formulas::refuse(const std::string& why, const std::string& remedy) const {
  throw Error(ErrorKind::kScene, {owner_, "", why, remedy});
}

RadialEnergy::RadialEnergy(Formulas& formulas, const std::string& of,
                           const std::vector<std::string>& others) {
  Graph& graph = formulas.graph;
  const int u = formulas.read("energy", of), first = graph.derivative(u, 0);
  formulas.check_all_read(others);
  const int both[] = {first, graph.derivative(first, 0)};
  energy = formulas.compile({&u, 1});
  slope = formulas.compile({both, 1});
  slopes = formulas.compile(both);
}

}  // namespace sim
