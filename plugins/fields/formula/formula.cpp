// First-order systems given as formulas: one a name, in one cell or in the cells of a lattice.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>

#include "core/base/text.h"
#include "core/base/utf8.h"
#include "core/expression/formulas.h"
#include "core/fields/pair_field.h"
#include "core/plugin/plugin.h"
#include "ensemble.h"
#include "lattice.h"
#include "lattice_program.h"
#include "lattice_stepper.h"
#include "straight_stepper.h"

namespace {

using sim::Formulas;
using sim::Lattice;
using sim::LatticeEdge;
using sim::List;

const char* const kOwner = "field 'formula'";
const std::vector<std::string> kParams = {"formulas", "names", "cells", "boundary"};

[[noreturn]] void refuse(const std::string& why, const std::string& remedy) {
  throw sim::Error(sim::ErrorKind::kScene, {kOwner, "", why, remedy});
}

std::string counted(std::size_t count, const std::string& what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

std::vector<std::string> texts_of(const sim::Params& params, const std::string& name,
                                  const std::string& form) {
  std::vector<std::string> texts;
  for (const auto& entry : params.list(name)) {
    if (!std::holds_alternative<std::string>(entry))
      refuse("entry " + std::to_string(texts.size() + 1) + " of " + name + " is a number",
             "write " + form);
    texts.push_back(std::get<std::string>(entry));
  }
  return texts;
}

std::vector<std::string> names_of(const sim::Params& params) {
  const std::vector<std::string> names =
      texts_of(params, "names", "names = {\"x\", \"y\"}, a name for each formula");
  const auto letter = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
  };
  std::set<std::string> known = {"t", "pi"};
  for (const std::string& name : names) {
    const bool word =
        !name.empty() && letter(name.front()) &&
        std::ranges::all_of(name, [&](char c) { return letter(c) || (c >= '0' && c <= '9'); });
    if (!word)
      refuse("the name '" + sim::visible_line(name) + "' is no name",
             "names are made of letters, digits and _, and begin with no digit");
    if (name == "t" || name == "pi")
      refuse("the name '" + name + "' has a meaning already", "choose another name");
    if (!known.insert(name).second)
      refuse("the name '" + name + "' is there twice", "give each number of a cell its own name");
  }
  if (names.empty()) refuse("it has no names", "write names = {\"x\", \"y\"}");
  return names;
}

// The number of cells in each direction; one number, 1, for a single cell.
std::vector<int> cells_of(const sim::Params& params) {
  constexpr double kMost = 1e8;
  std::vector<int> cells;
  if (!params.has("cells")) return cells;
  double all = 1;
  for (const auto& entry : params.list("cells")) {
    const double* const number = std::get_if<double>(&entry);
    if (!number || !(*number >= 1) || std::floor(*number) != *number || *number > kMost)
      refuse("cells is " + sim::to_text(params.value("cells")),
             "give whole numbers from 1 on: cells = N, {nx, ny} or {nx, ny, nz}");
    cells.push_back(static_cast<int>(*number));
    all *= *number;
  }
  if (cells.empty() || cells.size() > 3)
    refuse("its lattice has " + std::to_string(cells.size()) + " directions",
           "give cells = N, {nx, ny} or {nx, ny, nz}");
  if (all > kMost) refuse("it has more than 1e8 cells", "give fewer cells");
  return cells;
}

LatticeEdge edge_of(const sim::Params& params, const std::vector<std::string>& names) {
  LatticeEdge edge;
  if (!params.has("boundary")) return edge;
  const List& list = params.list("boundary");
  const std::string remedy = "give boundary = {a value for each name}, \"periodic\" or \"mirror\"";
  if (list.size() == 1 && std::holds_alternative<std::string>(list.front())) {
    const std::string& word = std::get<std::string>(list.front());
    if (word == "periodic")
      edge.kind = LatticeEdge::Kind::kPeriodic;
    else if (word == "mirror")
      edge.kind = LatticeEdge::Kind::kMirror;
    else
      refuse("boundary is '" + sim::visible_line(word) + "'", remedy);
    return edge;
  }
  for (const auto& entry : list) {
    if (!std::holds_alternative<double>(entry)) refuse("a value of its boundary is a text", remedy);
    edge.values.push_back(std::get<double>(entry));
  }
  if (edge.values.size() != names.size())
    refuse("boundary has " + counted(edge.values.size(), "value") + " for " +
               counted(names.size(), "name"),
           remedy);
  return edge;
}

// A field of formulas, which read these inputs in this order: names of the cell, t, neighbours.
class FormulaField final : public sim::PairField {
 public:
  explicit FormulaField(const sim::Params& params)
      : names_(names_of(params)), cells_(cells_of(params)), edge_(edge_of(params, names_)) {
    const std::vector<std::string> texts =
        texts_of(params, "formulas", "a formula for each name: \"a*(y - x)\"");
    if (texts.size() != names_.size())
      refuse(
          "it has " + counted(texts.size(), "formula") + " for " + counted(names_.size(), "name"),
          "give the time derivative of each name, in their order");
    std::vector<std::string> inputs = names_;
    inputs.emplace_back("t");
    sim::CellNames cells{static_cast<int>(names_.size()), static_cast<int>(cells_.size()), {}, {}};
    std::ranges::copy(cells_, cells.extents.begin());
    Formulas formulas(kOwner, params, inputs, {}, cells);
    for (std::size_t i = 0; i < texts.size(); ++i)
      roots_.push_back(formulas.parse(texts[i], "formula of " + names_[i] + "'"));
    formulas.check_all_read(kParams);
    if (params.has("boundary") && formulas.neighbours().empty())
      refuse("it has a boundary, but no formula reads a neighbour",
             "leave the boundary out, or write " + names_.front() + "[-1]");
    if (!params.has("boundary") && !formulas.neighbours().empty())
      refuse("formulas read neighbours, and what lies beyond the ends is not said",
             "give boundary = {a value for each name}, \"periodic\" or \"mirror\"");
    compile(formulas);
  }

  void bind(std::size_t size, int dimension) override {
    if (dimension != 1) refuse("its state is a flat list, not points", "write state = { 1, 0, 0 }");
    double cells = 1;
    for (const int count : cells_) cells *= count;
    const double wanted = cells * static_cast<double>(names_.size());
    if (static_cast<double>(size) != wanted)
      refuse("the state has " + counted(size, "number") + ", " + counted(names_.size(), "name") +
                 " in " + counted(static_cast<std::size_t>(cells), "cell") + " make " +
                 sim::shortest(wanted),
             "give state as many numbers: all names of the first cell, then of the next one");
    size_ = size;
    Lattice::Index reach{};
    for (const Lattice::Index& offset : neighbours_.offsets)
      for (std::size_t k = 0; k < 3; ++k) reach[k] = std::max(reach[k], std::abs(offset[k]));
    lattice_ = Lattice(static_cast<int>(names_.size()), cells_, reach, edge_);
    straight_ = lattice_.cells() == 1;
    bind_programs();
    find_entries();
  }

  sim::FieldLayout layout() const override {
    sim::FieldLayout layout{names_, {1, 1, 1}};
    std::ranges::copy(cells_, layout.cells.begin());
    return layout;
  }

  void begin(double t, std::span<const double> x) const override {
    std::vector<double> dxdt(x.size());
    eval(t, x, dxdt);
    for (std::size_t i = 0; i < dxdt.size(); ++i) {
      if (std::isfinite(dxdt[i])) continue;
      const std::size_t name = i % names_.size();
      refuse("the formula of " + names_[name] + "' is not finite at the start" +
                 (straight_ ? "" : ", in cell " + std::to_string(i / names_.size())),
             "look for a division by 0, or a root or logarithm of a negative number");
    }
  }

  void eval(double t, std::span<const double> x, std::span<double> dxdt) const override {
    if (straight_) {
      slopes_straight_.run(t, x, dxdt.data());
      return;
    }
    rows_.load(lattice_, x.data());
    slopes_.run(lattice_, t, rows_, [&](int slab, int row, const double* results) {
      lattice_.store_row(results, slab, row, dxdt.data());
    });
  }

  const sim::Sparsity* sparsity() const override { return &sparsity_; }

  void jacobian(double t, std::span<const double> x, std::span<double> values) const override {
    if (straight_) {
      jacobian_straight_.run(t, x, jacobian_results_.data());
      for (std::size_t i = 0; i < entries_.size(); ++i)
        values[static_cast<std::size_t>(places_[i])] = jacobian_results_[i];
      return;
    }
    std::ranges::fill(values, 0.0);
    rows_.load(lattice_, x.data());
    const std::size_t many = entries_.size();
    jacobian_.run(lattice_, t, rows_, [&](int slab, int row, const double* results) {
      const int* place =
          places_.data() + static_cast<std::size_t>(lattice_.first_cell(slab, row)) * many;
      for (int i = 0; i < lattice_.length(); ++i) {
        const double* result = results + i;
        for (std::size_t entry = 0; entry < many; ++entry, ++place, result += lattice_.pitch())
          if (*place >= 0) values[static_cast<std::size_t>(*place)] += *result;
      }
    });
  }

  std::unique_ptr<sim::Stepper> explicit_stepper(const sim::ExplicitPlan& plan) const override {
    if (plan.precision == sim::Precision::kSingle) return nullptr;
    if (straight_ && sim::StraightStepper::fits(code_, plan))
      return std::make_unique<sim::StraightStepper>(code_, plan, beside_);
    if (!straight_ && sim::LatticeStepper::fits(code_, plan))
      return std::make_unique<sim::LatticeStepper>(lattice_, neighbours_, code_, plan);
    return nullptr;
  }

  bool may_step_side_by_side() const override { return straight_; }
  bool step_side_by_side(std::span<const Run> runs) const override {
    std::vector<const FormulaField*> fields;
    std::vector<sim::Ensemble::Lane> lanes;
    for (const Run& run : runs) {
      const auto* const field = dynamic_cast<const FormulaField*>(run.field);
      const bool fits = field && field->straight_ && run.h == runs.front().h &&
                        sim::same_operations(code_, field->code_);
      if (!fits) continue;
      fields.push_back(field);
      lanes.push_back({&field->code_, run.start});
    }
    if (lanes.size() < 2) return false;
    const auto ensemble = std::make_shared<sim::Ensemble>(std::move(lanes), runs.front().h);
    for (std::size_t lane = 0; lane < fields.size(); ++lane)
      fields[lane]->beside_ = {ensemble, lane};
    return true;
  }

  std::unique_ptr<sim::EmbeddedStepper> embedded_stepper(
      const sim::EmbeddedPlan& plan) const override {
    if (!straight_ || !sim::StraightPair::fits(code_, plan)) return nullptr;
    return std::make_unique<sim::StraightPair>(code_, plan);
  }

 private:
  // Formulas of a single cell, evaluated on numbers instead of vectors.
  class Straight {
   public:
    Straight() = default;
    explicit Straight(const sim::Code& code)
        : inputs_(code.inputs), outputs_(code.outputs), slots_(code.slots(), 0.0) {
      std::ranges::copy(code.constants, slots_.begin() + code.first_constant());
      code_ = sim::StraightCode(code.instructions, [&](int slot) {
        return slot >= code.inputs && slot < code.first_constant();
      });
    }
    void run(double t, std::span<const double> x, double* out) {
      std::ranges::copy(x, slots_.begin());
      slots_[x.size()] = t;
      code_.run(slots_.data());
      std::copy_n(slots_.begin() + inputs_, outputs_, out);
    }

   private:
    int inputs_ = 0, outputs_ = 0;
    std::vector<double> slots_;
    sim::StraightCode code_;
  };

  // An entry of the Jacobian of each cell.
  struct Entry {
    int formula, name;
    Lattice::Index offset;
  };

  std::size_t time_input() const { return names_.size(); }

  void compile(Formulas& formulas) {
    for (const sim::Neighbour& neighbour : formulas.neighbours()) {
      neighbours_.offsets.push_back(Lattice::offset({neighbour.offset.data(), cells_.size()}));
      neighbours_.names.push_back(neighbour.input);
    }
    std::vector<int> derivatives;
    const int zero = formulas.graph.number(0);
    for (std::size_t formula = 0; formula < roots_.size(); ++formula)
      for (int input = 0; input < formulas.inputs(); ++input) {
        if (input == static_cast<int>(time_input())) continue;
        const int slope = formulas.graph.derivative(roots_[formula], input);
        if (slope == zero) continue;
        const int other = input - static_cast<int>(time_input()) - 1;
        entries_.push_back(
            {static_cast<int>(formula),
             other < 0 ? input : neighbours_.names[static_cast<std::size_t>(other)],
             other < 0 ? Lattice::Index{} : neighbours_.offsets[static_cast<std::size_t>(other)]});
        derivatives.push_back(slope);
      }
    code_ = sim::Code(formulas.graph, roots_, formulas.inputs());
    jacobian_code_ = sim::Code(formulas.graph, derivatives, formulas.inputs());
  }

  void bind_programs() {
    if (straight_) {
      slopes_straight_ = Straight(code_);
      jacobian_straight_ = Straight(jacobian_code_);
      jacobian_results_ = sim::Array(entries_.size());
      return;
    }
    rows_ = sim::LatticeRows(lattice_, lattice_.names(), lattice_.slabs(), lattice_.reach()[0]);
    slopes_ = sim::LatticeEvaluation(lattice_, neighbours_, code_);
    jacobian_ = sim::LatticeEvaluation(lattice_, neighbours_, jacobian_code_);
  }

  // The matrix entries of all cells; -1: the derivative by a number that never changes.
  void find_entries() {
    const int cells = lattice_.cells(), names = static_cast<int>(names_.size());
    std::vector<std::pair<int, int>> pairs, own;  // {column, row}
    for (int cell = 0; cell < cells; ++cell)
      for (const Entry& entry : entries_) {
        const int other = lattice_.neighbour(cell, entry.offset);
        own.emplace_back(other < 0 ? -1 : other * names + entry.name, cell * names + entry.formula);
        if (other >= 0) pairs.push_back(own.back());
      }
    sparsity_ = sim::Sparsity(cells * names, std::move(pairs));
    for (const auto& [column, row] : own)
      places_.push_back(column < 0 ? -1 : sparsity_.find(column, row));
  }

  std::vector<std::string> names_;
  std::vector<int> cells_;  // in each direction; none: a single one
  LatticeEdge edge_;
  std::vector<int> roots_;
  sim::LatticeNeighbours neighbours_;
  std::vector<Entry> entries_;
  sim::Code code_, jacobian_code_;
  std::size_t size_ = 0;
  Lattice lattice_;
  bool straight_ = false;  // a single cell: numbers, no vectors

  sim::Sparsity sparsity_;
  std::vector<int> places_;  // in its values, of the entries of each cell

  // The work space of an evaluation.
  mutable sim::LatticeRows rows_;
  mutable sim::LatticeEvaluation slopes_, jacobian_;
  mutable Straight slopes_straight_, jacobian_straight_;
  mutable sim::EnsembleLane beside_;
  mutable sim::Array jacobian_results_;
};

}  // namespace

SIM_PLUGIN(Field, "formula") {
  using sim::ParamType;
  registrar.add(sim::FieldPlugin{
      {.name = "formula",
       .summary = "right-hand sides as formulas, of a few numbers or of the cells of a lattice",
       .formula =
           "x' = F1, y' = F2, ..: a formula for each name, of all names and t\n"
           "u[-1] u[1] u[i, j] u[i, j, k]: the neighbours of a cell, counted from it\n"
           "^ * / + - ( );  sqrt exp log sin cos tan sinh cosh tanh abs sign step floor\n"
           "min max pow select(c, a, b);  pi;  \"u*w - v; w = u*v\"\n"
           "other names are numbers given to the field, a = 0.1\n"
           "state: all names of cell 0, then of cell 1 ..; of cells = {nx, ny} the cell (i, j)\n"
           "is number i ny + j; Jacobians are exact",
       .params = {{.name = "formulas",
                   .type = ParamType::kList,
                   .doc = "the time derivative of each name, in their order",
                   .required = true,
                   .positional = true},
                  {.name = "names",
                   .type = ParamType::kList,
                   .doc = "of the numbers of a cell",
                   .required = true},
                  {.name = "cells",
                   .type = ParamType::kList,
                   .doc = "of a lattice: N, {nx, ny} or {nx, ny, nz}; if not given, a single one"},
                  {.name = "boundary",
                   .type = ParamType::kList,
                   .doc = "beyond the ends of the lattice: {a value for each name}, \"periodic\", "
                          "or \"mirror\" (the first cell again, then the second: nothing flows "
                          "out)"}},
       .free_numbers = true,
       .example = {{"formulas", sim::List{"y", "-k*x - 0.1*y + 0*z", "x*y - z"}},
                   {"names", sim::List{"x", "y", "z"}},
                   {"cells", sim::List{4.0}},
                   {"k", 2.0}}},
      [](const sim::Params& params) { return std::make_unique<FormulaField>(params); }});
}
